// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

#include <toftwin/clock.h>

namespace toftwin::daemon {

using SteadyTime = std::chrono::steady_clock::time_point;

/// Where the daemon reads the time, so that tests can say what time it is. Any thread may ask.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual HostTime wall() const = 0;
  [[nodiscard]] virtual SteadyTime steady() const = 0;
};

/// The machine's clocks.
const Clock& systemClock();

}  // namespace toftwin::daemon
