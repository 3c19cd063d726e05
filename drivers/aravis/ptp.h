// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "drivers/aravis/features.h"
#include "drivers/clock_fit.h"

namespace toftwin::drivers::aravis {

/// Tells the log whether the camera's clock follows the network's (IEEE 1588): until it does, device time is
/// of the camera's own. Asked every second until then, every ten seconds afterwards, or if the camera does
/// not tell.
class PtpWatch {
 public:
  void look(const Features& features, const std::string& camera, SteadyTime now);

 private:
  std::optional<SteadyTime> asked_at_;
  std::string told_;  ///< the status that the log has
  std::chrono::seconds pause_{0};
  bool was_silent_ = false;
};

}  // namespace toftwin::drivers::aravis
