// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstdint>

namespace toftwin {

/// Nanoseconds on the sensor's own clock. Its zero is whatever the device says; it never goes back.
struct DeviceTime {
  std::int64_t ns = 0;
  auto operator<=>(const DeviceTime&) const = default;
};

/// Nanoseconds since the Unix epoch on the daemon's host (CLOCK_REALTIME).
struct HostTime {
  std::int64_t ns = 0;
  auto operator<=>(const HostTime&) const = default;
};

/// How the two clocks relate, as known when the frame was made: host = device + offset. `uncertainty`
/// is one standard deviation, or -1 where the driver cannot tell.
struct ClockRelation {
  std::int64_t host_minus_device_ns = 0;
  std::int64_t uncertainty_ns = -1;
  bool operator==(const ClockRelation&) const = default;
};

}  // namespace toftwin
