// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/frame.h>

#include "calib/compare/feed.h"

/// A twin at the moment of the camera that it is held against: a simulated camera takes time since power-on,
/// ambient light, room temperature and exposure as parameters.
namespace toftwin::compare {

inline constexpr const char* kSincePowerOn = "since_power_on_s";
inline constexpr const char* kExposure = "exposure_us";
inline constexpr const char* kAmbient = "ambient_klx";
inline constexpr const char* kRoom = "room_temperature_c";

bool takes(const Feed& feed, std::string_view parameter);

/// Of the raw exposures, if any is known.
std::optional<Duration> longestExposure(const Frame& frame);

struct MomentSetting {
  const char* parameter;
  double value;
};
/// What a frame says of its moment, by the parameter that it is to be set with; the room's temperature from
/// the carrier where the camera does not know it.
std::vector<MomentSetting> settingsOf(const Frame& frame, const Carrier* carrier);

/// By what the moments of two frames differ, where both say it, in a sentence: exposure by over 2 %, ambient light by over
/// 10 % and 0.1 klx, the room's temperature by over 2 °C, time since power-on by over 10 % and a minute. Empty: by nothing.
std::string momentWarning(const Frame& a, const Frame& b);

/// The camera of the two that is simulated, if the other one is not.
Feed* twinOf(Feed& a, Feed& b);

/// Sets a twin to the moments of another camera, and back.
class Follower {
 public:
  explicit Follower(Feed& twin) : twin_(&twin) {}
  [[nodiscard]] Feed& twin() const { return *twin_; }
  /// What did not follow, in sentences.
  std::vector<std::string> follow(const Frame& leader, const Carrier* carrier);
  /// To what it was set to when it was opened; what could not be set, in sentences.
  std::vector<std::string> putBack();

 private:
  Feed* twin_;
  std::map<std::string, double> set_;
};

}  // namespace toftwin::compare
