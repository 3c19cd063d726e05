// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/plan/captures.h"
#include "calib/plan/plan.h"

namespace toftwin::plan {

/// Beyond these a plan is refused.
struct Limits {
  /// |r| within a block between what is swept and time, or the camera's warming up.
  double goes_with_time = 0.5;
  /// Of each covariate on all others over the whole plan: 1 / (1 − R²), by how much the variance of an
  /// effect's estimate grows because the others look alike.
  double inflation = 5.0;
};

/// One thing that a plan's checker says.
struct Remark {
  bool refuses = false;  ///< else a note: what the plan cannot tell, although it is a good one
  std::string what{};
  std::string mend{};  ///< tried: the plan passes in this respect when it is done
};

/// One row of the design: what changes over the plan and what it goes with.
struct CovariateRow {
  std::string name;
  std::string unit;
  double min = 0.0, max = 0.0;
  std::size_t values = 0;  ///< different ones
  double with_time = 0.0;  ///< r over the whole plan
  double inflation = 0.0;  ///< infinite: a combination of the others; NaN: it does not change
  std::string closest{};   ///< what it goes with most of all
};

struct Check {
  std::vector<Remark> remarks;
  std::vector<CovariateRow> covariates;
  [[nodiscard]] bool passes() const;
};

/// Whether the order of a plan lets effects be told apart. Within each block: what is swept must not go with
/// time nor with warming up. Over the plan: no covariate (time, warm-up, distance, angle, exposure, ambient)
/// may be a combination of the others, or nearly.
Check check(const Plan& plan, const Schedule& schedule, const Limits& limits = {});

/// Variance inflation of each of the columns by the others, 1 / (1 − R²) with R² of its regression on them
/// (D. A. Belsley, E. Kuh, R. E. Welsch, Regression Diagnostics, 1980, ch. 3). Infinite where it is a
/// combination of them; columns must change.
std::vector<double> inflationOf(const std::vector<std::vector<double>>& columns);

}  // namespace toftwin::plan
