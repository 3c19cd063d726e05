// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "calib/loop/evidence.h"

namespace toftwin::loop {

/// By how much series of measurements differ where all columns are alike: what no function of the columns can explain.
struct Overlap {
  std::size_t rows = 0;     ///< of later series that have such rows in earlier ones
  double mean = 0.0;        ///< later less earlier
  double deviation = 0.0;   ///< of these differences about their mean
  double apart = 0.0;       ///< by how much alike rows differ in the reference, at most

  /// What each of two series has of it: any function of the columns, with an offset for each series, leaves at least this.
  [[nodiscard]] double least() const;
};

/// `left`: of each row what goes smoothly with the columns taken off, so that rows that are nearly alike compare. `series`: the
/// number of each row's series. Nothing where fewer than twenty rows have alike ones in an earlier series, or where there is no
/// reference.
std::optional<Overlap> overlapOf(const Evidence& evidence, const Eigen::VectorXd& left, const std::vector<int>& series);

}  // namespace toftwin::loop
