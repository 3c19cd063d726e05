// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "drivers/aravis/aravis.h"
#include "drivers/aravis/connection.h"
#include "drivers/aravis/features.h"
#include "drivers/aravis/images.h"
#include "drivers/aravis/region.h"

namespace toftwin::drivers::aravis {

/// What a camera will send, as it is set up now.
struct Setup {
  int width = 0, height = 0;
  Region region;
  Layout layout;
  Scan3d scan;
  std::optional<LensKeys> lens;  ///< as the camera says it
  std::optional<Duration> frame_interval;
  bool is_triggered = false;  ///< by something, software or an input
  bool can_trigger = false;   ///< by software
  std::vector<std::string> parameters;
};

/// In free run, as the camera is set now; nothing if it does not say so.
std::optional<Duration> frameIntervalOf(const Features& features);
[[nodiscard]] bool isTriggered(const Features& features);

/// "ExposureTime = 1000"; nothing if it is no assignment.
std::optional<std::pair<std::string, std::string>> assignmentOf(const std::string& text);

/// Sets the camera up as the keys say, and reads what came of it. Incompatible, InvalidArgument or NotFound where
/// the camera cannot do what is wanted, Incompatible also where it sends nothing that can be read.
Result<Setup> configure(const Connection& connection, const Keys& keys);

}  // namespace toftwin::drivers::aravis
