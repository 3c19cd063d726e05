// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include <toftwin/result.h>

#include "calib/suit/use_case.h"
#include "calib/suit/values.h"
#include "sim/images/light.h"
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

/// Light of a simulation that another one will need again: that of the first variant, for it takes far longer
/// to trace than to read out. Beyond `most_bytes` nothing is kept, and is traced again.
class KeptLight {
 public:
  /// Of a pose of the whole use case, a repeat and a raw exposure.
  using Key = std::tuple<std::size_t, int, std::size_t>;
  explicit KeptLight(std::size_t most_bytes = std::size_t{1} << 30U) : left_(most_bytes) {}
  [[nodiscard]] const sim::Light* find(const Key& key) const {
    const auto found = kept_.find(key);
    return found == kept_.end() ? nullptr : &found->second;
  }
  void keep(const Key& key, const sim::Light& light);

 private:
  std::size_t left_;
  std::map<Key, sim::Light> kept_{};
};

/// Simulates each variant at each pose under each lighting. Variants that differ in the model's effects and
/// exposures alone see the very same light and noise, so what differs between them is what they do.
/// One repeat: without `together`. [variant][condition]; Error Stopped if given up.
/// `kept`: light of the first variant and those that see the same, of simulations of this very camera and
/// scene; what is missing is added.
Result<std::vector<std::vector<ConditionValues>>> simulate(const Case& use, const sim::Scene& scene,
                                                           const std::vector<Variant>& variants,
                                                           Repeats repeats, const Watch& watch,
                                                           KeptLight* kept = nullptr);

/// Whether a requirement is to hold at this pose and lighting.
bool concerns(const RequirementSpec& requirement, const Case& use, std::size_t pose, std::size_t lighting);

/// What a camera sees from there, by one ray for each pixel.
Seen seenFrom(const sim::Scene& scene, const CameraInfo& camera, const Transform<World, Camera>& pose,
              Duration time);

/// A frame as often as the camera gives one: its interval, or its exposures where these take longer.
double frameRateOf_hz(const sim::SensorModel& model);

}  // namespace toftwin::suit
