// SPDX-License-Identifier: Apache-2.0
// A Kinect v2, 512 × 424 pixels, 3 frequencies × 3 steps, emitter shadow, multipath, lens scatter, distortion
// and noise, in a closed room of 4 × 2.5 × 5 m with a bumpy sphere of 100,000 triangles that moves by 0.3
// m/s.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "sim/sensor/sensor_model.h"
#include "sim/tracer/realtime.h"
#include "tests/bench/measured.h"

namespace toftwin::bench {

using namespace toftwin::sim;

inline constexpr Duration kInterval = 33.333333_ms;

/// A sphere of radius 0.6 m with bumps, 2 · steps² triangles, as a binary PLY file.
void writeBumpySphere(const std::filesystem::path& file, int steps);

/// The room, the camera and the configuration in a folder of their own.
class Files {
 public:
  explicit Files(int steps = 224);
  ~Files() { std::filesystem::remove_all(folder_); }
  Files(const Files&) = delete;
  Files& operator=(const Files&) = delete;

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] std::filesystem::path scene() const { return folder_ / "room.toml"; }
  /// The sphere stands still in it.
  [[nodiscard]] std::filesystem::path stillScene() const { return folder_ / "still_room.toml"; }
  [[nodiscard]] std::filesystem::path camera() const { return folder_ / "camera.toml"; }

 private:
  std::filesystem::path folder_;
};

/// The camera frame after frame, as the driver runs it but that it begins frames ahead.
class Kinect {
 public:
  explicit Kinect(const Files& files, std::uint64_t seed = 1)
      : model(orGiveUp(SensorModel::load(files.camera()))),
        scene(orGiveUp(Scene::load(files.scene()))),
        seed_(seed) {
    request = model.traceRequest();
    request.max_surfaces = 16;
    request.seed = seed;
    seen_ = model.correlatedTerms();
  }
  [[nodiscard]] Duration time() const { return static_cast<double>(frame) * kInterval; }
  [[nodiscard]] Moment moment() const {
    Moment moment;
    moment.exposures = model.exposures({static_cast<std::int64_t>(time().in(nanosecond))});
    moment.since_power_on = 10'800_s;
    return moment;
  }
  const Light& trace() { return *(light = &tracer.next(scene.at(time()), request, seen_)); }
  /// Begins a frame a centimetre beside the ones before.
  void beginElsewhere() {
    TraceRequest elsewhere = request;
    elsewhere.world_from_camera.translation_m.x += 0.01;
    tracer.begin(scene.at(time()), elsewhere, seen_);
  }
  [[nodiscard]] SensorModel::Exposed expose() const { return {{}, model.measure(*light, moment(), seed_, frame)}; }
  [[nodiscard]] Samples collect(const SensorModel& with) const {
    return with.collect(*light, moment(), seed_, frame);
  }
  [[nodiscard]] SensorModel::Exposed readOut(const SensorModel& with, Samples samples,
                                             std::uint64_t noise) const {
    return with.readOut(std::move(samples), moment(), seed_, noise);
  }

  SensorModel model;
  Scene scene;
  TraceRequest request;
  RealtimeTracer tracer;
  const Light* light = nullptr;
  std::uint64_t frame = 0;

 private:
  std::uint64_t seed_;
  std::vector<SeenHarmonic> seen_;
};

}  // namespace toftwin::bench
