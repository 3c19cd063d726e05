// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/suit/use_case.h"
#include "calib/suit/values.h"
#include "sim/sensor/sensor_model.h"
#include "sim/tracer/scene.h"

namespace toftwin::suit {

/// What is simulated of a camera: its model, and what of light and motion is left out to see what that
/// spoils.
struct Variant {
  std::string name{};
  sim::SensorModel model;
  int max_surfaces = 4;
  double pixel_extent = 1.0;
  bool stands_still = false;  ///< nothing moves while a frame is taken
};

/// Values of all requirements at one pose under one lighting; NaN where the requirement is not about them.
struct ConditionValues {
  std::size_t pose = 0, lighting = 0;
  std::vector<std::size_t> pixels{};           ///< of each requirement
  std::vector<std::vector<double>> repeats{};  ///< [requirement][repeat]
  std::vector<double> together{};              ///< [requirement], of the light of all repeats
  std::size_t frames = 0;                      ///< in each repeat
};

/// How far a simulation is, 0 to 1; false: give up.
using Watch = std::function<bool(double share)>;

/// Which independent simulations: their numbers key their light and their noise.
struct Repeats {
  int first = 0, count = 1;
};

/// Simulates each variant at each pose under each lighting. Variants that differ in the model's effects and
/// exposures alone see the very same light and noise, so what differs between them is what they do.
/// One repeat: without `together`. [variant][condition]; Error Stopped if given up.
Result<std::vector<std::vector<ConditionValues>>> simulate(const Case& use, const sim::Scene& scene,
                                                           const std::vector<Variant>& variants,
                                                           Repeats repeats, const Watch& watch);

/// Whether a requirement is to hold at this pose and lighting.
bool concerns(const RequirementSpec& requirement, const Case& use, std::size_t pose, std::size_t lighting);

/// What a camera sees from there, by one ray for each pixel.
Seen seenFrom(const sim::Scene& scene, const CameraInfo& camera, const Transform<World, Camera>& pose,
              Duration time);

/// A frame as often as the camera gives one: its interval, or its exposures where these take longer.
double frameRateOf_hz(const sim::SensorModel& model);

}  // namespace toftwin::suit
