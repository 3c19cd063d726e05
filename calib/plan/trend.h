// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/plan/run_log.h"

namespace toftwin::plan {

/// A number of one run, held against the first run's.
struct TrendRow {
  LoggedTrait at{};
  bool is_first = false;
  /// Value less the first's, with an interval that holds the changes of all rows together with 95 %; NaN where an
  /// end of an interval it is made from is not known.
  double change = 0.0, low = 0.0, high = 0.0;
  [[nodiscard]] bool isChanged() const { return !is_first && (low > 0.0 || high < 0.0); }
};

/// One number over the runs of the same cameras and the same plan, by when they began.
struct TrendSeries {
  std::string title{};
  std::vector<TrendRow> rows{};
};

/// Series of what a log's traits() gave. Changes are compare::differenceOf(), widened for those of all series
/// together.
std::vector<TrendSeries> trendsOf(const std::vector<LoggedTrait>& traits);

}  // namespace toftwin::plan
