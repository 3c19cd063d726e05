// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include "sim/decode/unwrap.h"

namespace toftwin::sim {

/// The nearest whole number, for |x| < 2⁵¹: what 1.5·2⁵² rounds away. Baseline x86 has no
/// instruction for it.
inline double nearestWhole(double x) { return (x + 0x1.8p52) - 0x1.8p52; }

/// unwrapKinectV2() without branches, for loops that become vector code.
inline __attribute__((always_inline)) Unwrapped joinKinectV2(double cycles_80, double cycles_16,
                                                             double cycles_120, double unit_m) {
  constexpr double kPerSquare = 1.0 / 329.0;
  const double first_80 = 3.0 * (cycles_80 + nearestWhole(5.0 * cycles_16 - cycles_80));
  const double periods_beside_120 = first_80 / 2.0 - cycles_120;
  const bool is_second_half = std::abs(periods_beside_120 - nearestWhole(periods_beside_120)) > 0.25;
  const double units_80 = is_second_half ? first_80 + 15.0 : first_80;
  const double full_16 = is_second_half ? cycles_16 + 1.0 : cycles_16;
  const double full_80 = units_80 * (1.0 / 3.0);
  const double full_120 = cycles_120 + nearestWhole(units_80 / 2.0 - cycles_120);
  // Distance from the line through 0 along (10, 2, 15): |k × n|, n the unit vector along it, 10² + 2² + 15² =
  // 329
  const double x = full_16 * 15.0 - full_120 * 2.0;
  const double y = full_120 * 10.0 - full_80 * 15.0;
  const double z = full_80 * 2.0 - full_16 * 10.0;
  return {.range_m = unit_m * (30.0 / 27.0) * (full_80 + full_16 + full_120),
          .deviation_rad = 2.0 * std::numbers::pi * __builtin_sqrt((x * x + y * y + z * z) * kPerSquare)};
}

}  // namespace toftwin::sim
