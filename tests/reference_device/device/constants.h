// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <numbers>

namespace toftwin::reference {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kSpeedOfLight_m_per_s = 299'792'458.0;
inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();  ///< of a pixel without a value

}  // namespace toftwin::reference
