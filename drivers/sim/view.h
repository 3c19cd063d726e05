// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <stop_token>
#include <vector>

#include <toftwin/frame.h>

#include "sim/images/light.h"
#include "sim/sensor/interference.h"
#include "sim/sensor/sensor_model.h"
#include "sim/tracer/motion.h"
#include "sim/tracer/realtime.h"
#include "sim/tracer/trace.h"

namespace toftwin::drivers::simulator {

/// What the camera sees from its pose, traced once and kept until the pose changes or time passes over things
/// that move. Traced in bands of rows, so that it can be interrupted; the bands done are kept, and the result
/// does not depend on it. Each pose has random numbers of its own (light_seed.h).
class View {
 public:
  /// `request` with everything filled in but pose and region; interferences with the scene's foreign emitters.
  View(sim::Scene scene, sim::TraceRequest request, std::vector<sim::Interference> interferences, sim::Motion camera = {},
       Duration row_delay = {})
      : scene_(std::move(scene)),
        camera_(std::move(camera)),
        row_delay_(row_delay),
        request_(std::move(request)),
        interferences_(std::move(interferences)) {
    if (interferences_.size() != foreign_.size()) throw std::invalid_argument{"a view needs an interference per foreign emitter"};
  }

  [[nodiscard]] const sim::Scene& scene() const { return scene_; }
  /// At time 0.
  [[nodiscard]] const Transform<World, Camera>& pose() const { return pose_; }
  [[nodiscard]] Transform<World, Camera> poseAt(Duration time) const {
    return sim::poseAt(camera_, pose_, time);
  }
  void setPose(const Transform<World, Camera>& world_from_camera);

  /// Looks from now on with the frequencies of that model, which is the same but for those and its parameters.
  void setModel(const sim::SensorModel& model);

  /// Whether raw exposures see different light: scene or camera move, or another camera's light beats.
  [[nodiscard]] bool changesWithTime() const { return moves() || !scene_.foreignEmitters().empty(); }
  /// Makes complete() trace what is seen at a time since device time 0, if anything moves; with a rolling shutter
  /// the first row's time, and each band of four rows sees its own. The tracer's own noise is independent for each `number`.
  void moveTo(Duration time, std::uint64_t number);

  /// Traces what is not traced yet. False if asked to stop before the end.
  bool complete(const std::stop_token& stop);
  /// Called with the number of rows when complete() has traced so many; `rows` of them make a whole image.
  void whenRowsAreTraced(std::function<void(int)> tell) { tell_ = std::move(tell); }
  [[nodiscard]] int rows() const { return request_.camera.height * static_cast<int>(1 + foreign_.size()); }
  /// The light of the whole image, once complete() said so; in real time that of the last frame.
  [[nodiscard]] const sim::Light& light() const { return realtime_light_ != nullptr ? *realtime_light_ : own_.light; }

  /// From now on light is traced frame by frame, those of its phasors that the model wants.
  void goRealtime(const sim::SensorModel& model);
  [[nodiscard]] bool isRealtime() const { return realtime_.has_value(); }
  /// Traces the light of one frame, as it is at a time since device time 0.
  void traceFrame(Duration time);
  /// Whether beginFrame() saves any time.
  [[nodiscard]] bool worksAhead() const { return realtime_ && sim::RealtimeTracer::worksAhead(scene_, request_); }
  /// Begins what traceFrame() will be asked for unless the pose changes; meanwhile others may read light().
  void beginFrame(Duration time);
  /// The same with what other cameras add to a raw exposure.
  [[nodiscard]] const sim::Light& lightFor(const Exposure& exposure);

 private:
  sim::Scene scene_;
  sim::Motion camera_;
  Duration row_delay_;
  Duration time_{};  ///< of moveTo()
  Transform<World, Camera> pose_;
  sim::TraceRequest request_;
  std::vector<sim::Interference> interferences_;
  std::uint64_t seed_ = request_.seed;
  /// One emitter's or camera's light, as far as it is traced.
  struct Pass {
    sim::Light light;
    int rows_done = 0;
  };
  [[nodiscard]] bool moves() const { return scene_.moves() || !camera_.isStill(); }
  [[nodiscard]] sim::Scene sceneAt(Duration time) const { return scene_.moves() ? scene_.at(time) : scene_; }
  [[nodiscard]] sim::TraceRequest requestAt(Duration time) const;
  bool complete(const sim::Interference* interference, Pass& pass, const std::stop_token& stop) const;
  void forget();
  std::optional<sim::RealtimeTracer> realtime_;
  std::vector<sim::SeenHarmonic> seen_;                ///< in real time
  struct Begun {
    Duration time;
    Transform<World, Camera> pose;
    bool operator==(const Begun&) const = default;
  };
  /// Where nothing moves any time will do.
  [[nodiscard]] Begun begunAt(Duration time) const { return {moves() ? time : Duration{}, poseAt(time)}; }
  std::optional<Begun> begun_;  ///< by beginFrame()
  const sim::Light* realtime_light_ = nullptr;      ///< the tracer's
  Pass own_;
  std::vector<Pass> foreign_{scene_.foreignEmitters().size()};
  sim::Light mixed_;  ///< what lightFor() gave last
  std::function<void(int)> tell_;
};

}  // namespace toftwin::drivers::simulator
