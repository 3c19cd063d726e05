// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/compare/plot.h"

namespace toftwin::compare {

/// How two columns are held against each other.
enum class Rest { Difference, Ratio };

/// The panel below a plot: rows of what is left over x, and a band for what of it is noise.
///
/// The noise is what neighbours differ by, whatever curve they follow: σ² = mean (r_{i+1} − r_i)² / 2 (J. von
/// Neumann et al., Ann. Math. Stat. 12 (1941) 153), of ratios in their logarithm; the band is ±1.96 σ, in
/// up to eight groups of neighbours. Noise that is alike in neighbours makes it too narrow. Without a band
/// where there are fewer than eight rows.
Panel restPanel(std::string y_label, std::span<const double> x, std::span<const double> rest,
                Rest rule = Rest::Difference);

/// Measured less simulated (over, of ratios) row by row. Drawn is what all but the outermost 1 % at either
/// end need: at outlines a few rows lie far off.
Panel measuredLess(std::span<const double> x, std::span<const double> measured,
                   std::span<const double> simulated, Rest rule = Rest::Difference);

}  // namespace toftwin::compare
