// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

namespace toftwin {

/// What a pixel or a figure without a value holds. A float, so that it goes into images and into double
/// figures alike.
inline constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

}  // namespace toftwin
