// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <toftwin/fields.h>
#include <toftwin/result.h>

#include "drivers/o3d303/o3d303.h"
#include "drivers/o3d303/rpc.h"

namespace toftwin::drivers::o3d303 {

/// The active application of the camera as far as we use it: texts by the camera's own names.
struct Configuration {
  std::map<std::string, std::string> application;  ///< TriggerMode, …
  std::map<std::string, std::string> imager;       ///< ExposureTime, FrameRate, Type, …
};
using Changes = std::vector<std::pair<std::string, std::string>>;  ///< name, value

/// Parameters that can be set while the camera runs: our name, the imager's name, bounds.
struct Adjustable {
  std::string_view name, imager_name;
  Bounds bounds;
  bool is_integral;
};
inline constexpr std::array kAdjustables{
    Adjustable{"exposure_us", "ExposureTime", {1.0, 10'000.0}, true},
    Adjustable{"frame_rate_hz", "FrameRate", {0.1, 30.0}, false},
    Adjustable{"minimum_amplitude", "MinimumAmplitude", {0.0, 65'535.0}, true},
    Adjustable{"channel", "Channel", {0.0, 3.0}, true},
};

/// What the keys ask to be changed.
struct Wanted {
  Changes application, imager;
};
Wanted changesFor(const Keys& keys, const Configuration& now);

/// Opens a session, makes and saves the changes and reads all back. The camera takes no frames
/// meanwhile. Busy if another program configures the camera.
Result<Configuration> configure(Rpc& rpc, const Keys& keys);
Result<Configuration> configure(Rpc& rpc, const Keys& keys, const Changes& imager);

}  // namespace toftwin::drivers::o3d303
