// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <stop_token>

#include <toftwin/clock.h>

namespace toftwin::drivers {

using SteadyTime = std::chrono::steady_clock::time_point;

/// The longest a source may wait for a frame before it says Timeout, so that whoever watches it can
/// tell waiting from being stuck.
inline constexpr std::chrono::seconds kLongestWait{1};

/// Sleeps until that time. False if asked to stop before.
bool sleepUntil(SteadyTime time, const std::stop_token& stop);

/// How a device clock that runs with the host's steady clock relates to the host's wall clock,
/// where `device` is the device's time at the steady time `at`. Reads the wall clock between two
/// readings of the steady clock; half of their distance bounds the error of the relation.
ClockRelation relateToHost(DeviceTime device, SteadyTime at);

}  // namespace toftwin::drivers
