// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned/range_guess.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace toftwin::sim {
namespace {

/// What cameras of one metre to a room's length measure. A step is so short that a bend of 1 mm in (100 mm)², which is a strong one, is met
/// to 2e-5 mm by straight lines between them.
constexpr double kLow_mm = 100.0, kHigh_mm = 12'100.0, kStep_mm = 1.0;
constexpr auto kSteps = static_cast<std::size_t>((kHigh_mm - kLow_mm) / kStep_mm);

}  // namespace

RangeGuess::RangeGuess(const Errors& errors) {
  std::vector<double> range_mm(kSteps + 1), u_mm(kSteps + 1, 0.0);
  for (std::size_t i = 0; i <= kSteps; ++i) range_mm[i] = kLow_mm + kStep_mm * static_cast<double>(i);
  errors(range_mm, u_mm);
  for (std::size_t i = 0; i <= kSteps; ++i) u_mm[i] += range_mm[i];
  ranges_.resize(kSteps + 1);
  std::size_t below = 0;  // the last range whose u lies below, of those that come in order
  for (std::size_t i = 0; i <= kSteps; ++i) {
    const double u = range_mm[i];  // the grid of u is that of the ranges
    while (below + 2 <= kSteps && u_mm[below + 1] <= u) ++below;
    const double rise = u_mm[below + 1] - u_mm[below];
    ranges_[i] = rise > 0.0 ? range_mm[below] + (u - u_mm[below]) * (kStep_mm / rise) : u;
    if (!(std::abs(ranges_[i] - u) < kHigh_mm)) ranges_[i] = u;
  }
}

void RangeGuess::of(std::span<const double> u_mm, std::span<double> range_mm) const {
  const double* const ranges = ranges_.data();
  for (std::size_t i = 0; i < u_mm.size(); ++i) {
    const double u = u_mm[i];
    double at = (u - kLow_mm) * (1.0 / kStep_mm);
    const bool is_within = at >= 0.0 && at < static_cast<double>(kSteps);
    at = is_within ? at : 0.0;
    const auto below = static_cast<std::int32_t>(at);
    const double guessed = ranges[below] + (at - static_cast<double>(below)) * (ranges[below + 1] - ranges[below]);
    range_mm[i] = is_within ? guessed : u;
  }
}

}  // namespace toftwin::sim
