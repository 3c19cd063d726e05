// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace toftwin::table {

/// How one column follows another, whatever up to a third of odd rows (stuck, wrapped) do.
struct LineFit {
  std::size_t pairs = 0;       ///< rows where both are there
  double rank = 0.0;           ///< Spearman's correlation of ranks
  double slope = 0.0;          ///< of y over x: Siegel's repeated median
  double beside = 1.0;         ///< median distance from the line over the median distance of y from its median
  double spread_x = 0.0, spread_y = 0.0;  ///< from the tenth to the ninetieth percentile
};

/// Of at most 400 rows, evenly taken.
LineFit lineThrough(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace toftwin::table
