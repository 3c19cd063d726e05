// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/plan/plan.h"
#include "sim/sensor/sensor_model.h"
#include "sim/tracer/scene.h"

namespace toftwin::discover {

/// A run of `toftwin measure` made without a daemon: what a simulated camera would have recorded,
/// with a rig and a lamp that are a little off.
struct SimulatedRun {
  const plan::Plan& plan;
  const sim::SensorModel& camera;  ///< with what is hidden in it
  const sim::Scene& scene;
  std::map<std::string, sim::Scene> scene_of_block{};
  std::uint64_t seed = 1;
  double pose_error_m = 1e-3, pose_error_deg = 0.1, light_error = 0.01;
  double rig_mm_per_m = 0.0;  ///< the rig goes that much farther than it says
  /// What no camera file says is done to each frame's ranges: an effect of no catalogue.
  std::function<void(sim::RangeImage&, const Moment&, const CameraInfo&, std::uint64_t frame)> spoil{};
  bool with_poses = true;
  int max_surfaces = 1;  ///< of the light that the camera sees
  std::vector<int> bumped{};  ///< captures of these numbers stood ten times as far off as the others
  int frames = 0;  ///< of each capture; 0: the plan's
  bool with_samples = false;  ///< raw exposures, too
  /// As the simulator of toftwind does it: light is traced by so many paths a pixel, which tiles share, once for each
  /// place, and frames say its noise. 0: by many, anew for each capture, and they do not.
  int shared_paths = 0;
};

/// Writes the folder. Throws std::runtime_error: a test has no other use for it.
void write(const SimulatedRun& run, const std::filesystem::path& folder);

/// The text with each first part replaced by the second. Throws std::runtime_error where the text has none: a test that
/// goes on without would test something else.
std::string withReplaced(std::string text, std::initializer_list<std::pair<std::string_view, std::string>> parts);

/// A small camera of 44 × 33 pixels with two frequencies, as text; `effects` are appended to it.
std::string smallCamera(const std::string& effects = {});
/// The same with 28 × 21 pixels: whole searches in a few seconds.
std::string tinyCamera(const std::string& effects = {});
/// A wall with a bright plate before it, and a floor: something to see from everywhere.
std::string smallScene();
/// Two bright boards that meet at a right angle: half of their light has been at both.
std::string cornerScene();
/// Ten captures of it, none of them locked.
std::string cornerPlan();
/// 30 captures and 8 locked ones: warm-up, distance, exposure, ambient, tilt.
std::string smallPlan();

}  // namespace toftwin::discover
