// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "drivers/sim/keys.h"
#include "drivers/sim/view.h"
#include "sim/sensor/color.h"
#include "sim/sensor/sensor_model.h"
#include "tools/cli/campaign/trajectory.h"

namespace toftwin::cli {

/// What frames are made of, besides camera and scene.
struct RenderSettings {
  drivers::simulator::Keys keys{};  ///< samples_per_pixel, max_surfaces, pixel_extent, seed
  double since_power_on_s = 0.0;    ///< at device time 0
  double ambient_klx = 0.0;
  double room_temperature_c = 0.0;
  std::uint64_t first_noise = 0;  ///< number of the first frame, which keys its noise
  bool freeze = false;            ///< all raw exposures of a frame see the world as it is at the middle one
};

/// What effects remember of the frame before.
struct FrameMemory {
  std::optional<sim::Samples> collected{};
  std::optional<sim::RangeImage> range{};
};

/// Makes the frames of a campaign in any order: each depends on its number alone, and on the one before
/// where an effect remembers it.
class FrameMaker {
 public:
  /// `pose` where the trajectory is empty.
  FrameMaker(sim::SensorModel model, const sim::Scene& scene, Trajectory trajectory,
             const Transform<World, Camera>& pose, Schedule schedule, RenderSettings settings,
             std::vector<PlaneKind> planes, std::string source);

  /// Adds the plane `color`: what the camera's colour lens, which it must have, sees of this.
  void addColor(sim::VisibleScene scene) { visible_ = std::move(scene); }

  /// Told now and then how much of the frame is done, 0 to 1; false: give up.
  using Watch = std::function<bool(double share)>;
  /// Error Stopped if given up.
  Result<Frame> make(std::uint64_t number, const Watch& watch);
  /// A frame like all others but for the values of its pixels.
  Frame example();

  [[nodiscard]] const Schedule& schedule() const { return schedule_; }
  [[nodiscard]] const sim::SensorModel& model() const { return model_; }
  [[nodiscard]] const sim::Scene& scene() const { return view_.scene(); }
  [[nodiscard]] bool remembers() const { return model_.remembers(); }
  [[nodiscard]] const FrameMemory& memory() const { return memory_; }
  void remember(FrameMemory memory) { memory_ = std::move(memory); }

 private:
  [[nodiscard]] sim::Motion motion() const;
  [[nodiscard]] Moment momentOf(std::uint64_t number) const;
  [[nodiscard]] Frame frameOf(std::uint64_t number, const Moment& moment) const;
  void place(std::uint64_t number);
  /// What is said of the light of this frame, not made of it.
  void keep(const sim::Light& light);
  Result<Plane> colorOf(const Moment& moment, std::uint64_t number, const Watch& watch);
  std::optional<sim::Samples> gather(std::uint64_t number, const Moment& moment);

  sim::SensorModel model_;
  Trajectory trajectory_;
  Transform<World, Camera> pose_;
  Schedule schedule_;
  RenderSettings settings_;
  std::vector<PlaneKind> planes_;
  std::string source_;
  drivers::simulator::View view_;
  std::optional<sim::VisibleScene> visible_;
  sim::Truth truth_;
  std::optional<Plane> light_sigma_;  ///< if it is wanted
  FrameMemory memory_;
  std::stop_source stop_;
};

}  // namespace toftwin::cli
