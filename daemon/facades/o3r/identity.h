// SPDX-License-Identifier: Apache-2.0
#pragma once

/// What the unit and its heads say that they are.
namespace toftwin::daemon::o3r {

inline constexpr const char* kFirmware = "1.4.30-4123";
inline constexpr const char* kImager = "IRS2381C";
inline constexpr int kDeviceNumber = 769;  ///< of DeviceType "1:769"; in hexadecimal device/info/device

}  // namespace toftwin::daemon::o3r
