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

/// Series of what a log's traits() gave. Intervals of changes are MOVER's (G. Y. Zou, A. Donner, Stat. Med. 27 (2008)
/// 1693): d − √((v − l)² + (u₁ − v₁)²) to d + √((u − v)² + (v₁ − l₁)²). Over the m changes of all series they are
/// widened to Šidák's level 0.95^(1/m), as normal ones are.
std::vector<TrendSeries> trendsOf(const std::vector<LoggedTrait>& traits);

}  // namespace toftwin::plan
