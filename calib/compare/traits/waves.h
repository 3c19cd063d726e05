// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "calib/compare/traits/traits.h"

namespace toftwin::compare {

/// A wave of an error over distance.
struct Wave {
  double per_m = 0.0;  ///< radians per metre of distance
  std::string name{};
};

/// Of each frequency as many per period as `orders` says; those of equal length are one, under both names.
std::vector<Wave> wavesOf(std::span<const double> frequency_hz, std::span<const int> orders);

/// Why each of the `fitted` waves may be another's, in their order; empty: it is its own. At these distances
/// a wave of `left_out` shows in a fit c + s d + Σ waves as those that are fitted; it is in doubt what one of
/// them, as large and of the phase that does most, would change by over a half of itself. The fit's rows all
/// weigh the same: of a fit with errors that captures share it is an approximation. Where there are fewer
/// rows than numbers to fit, all are in doubt.
std::vector<std::string> doubtsOf(const std::vector<Wave>& fitted, const std::vector<Wave>& left_out,
                                  Column distance_m);

}  // namespace toftwin::compare
