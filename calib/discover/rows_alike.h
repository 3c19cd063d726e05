// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Dense>

#include "calib/discover/table_data.h"

/// Rows that err alike although no column says so.
namespace toftwin::discover {

/// Rows that follow each other with the same value of a covariate: what was logged once for a capture.
struct Runs {
  std::string covariate{};
  std::vector<int> run{};  ///< number of each row's run, from 0
  int count = 0;
};
/// Of each covariate whose values stay for three rows on average in at least eight runs and rarely come back:
/// a setting does. They say nothing of the errors. The fewest runs first.
std::vector<Runs> runsOfEqualValues(const TableData& data);

/// How far runs' means lie from each other beyond what the rows' own scatter makes of them: F of the one-way
/// analysis of variance less its expectation of 1, in its standard deviations. `residual`: of a fit of
/// everything smooth.
double alikeness(const Runs& runs, const Eigen::VectorXd& residual);

}  // namespace toftwin::discover
