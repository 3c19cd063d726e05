// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/plan/run_log.h"

namespace toftwin::plan {

/// A number of one run, held against that of the first finished run of two cameras in which it is not in doubt; of runs
/// none of which is so, the first finished one's of two cameras; of runs none of which is that, the first's.
struct TrendRow {
  LoggedTrait at{};
  bool is_told = true;  ///< or the run does not tell the number, and `at` has only the run
  bool is_first = false;
  /// Value less the first's, with an interval that holds the changes of all rows together with 95 %; NaN where an
  /// end of an interval it is made from is not known.
  double change = 0.0, low = 0.0, high = 0.0;
  bool is_in_doubt = false;  ///< it, or the first: what it is held against
  bool is_first_of_one_camera = false;  ///< so that nothing is held against it
  bool is_of_another_signal = false;  ///< than the first, as a part of a noise law: another number under its name
  std::int64_t first_planned = 0;  ///< captures of the first's plan, without blocks that were skipped; 0: not known
  /// A run that is not through may lack just those captures that would have made the number what it was; of one in which
  /// one camera was given twice nothing is known of the other.
  [[nodiscard]] bool isJudged() const {
    return is_told && !is_first && !is_in_doubt && !is_first_of_one_camera && !is_of_another_signal &&
           !at.run.isUnfinished() && !at.run.isOfOneCamera();
  }
  [[nodiscard]] bool isChanged() const { return isJudged() && (low > 0.0 || high < 0.0); }
};

/// One number over the runs of the same cameras and the same plan, by when they began.
struct TrendSeries {
  std::string title{};
  std::vector<TrendRow> rows{};
};

/// Series of what a log's traits() gave, with a row for each of its runs() of the same cameras and plan, whether it
/// tells the number or not. Changes are compare::differenceOf(), widened for those that are judged, of all series
/// together.
std::vector<TrendSeries> trendsOf(const std::vector<LoggedTrait>& traits, const std::vector<LoggedRun>& runs = {});

}  // namespace toftwin::plan
