// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calib/loop/explain.h"

namespace toftwin::loop {

/// From so many groups on their means are searched as a table's rows are.
inline constexpr int kGroupsSearched = 20;

/// What the offsets of sessions or captures go with, of the covariates that are one number in each. Groups are the units: from twenty on
/// their means are searched as a table's rows are; of fewer, which are little information and not none, the test of one simple shape is
/// Student's of what is left between groups, times how many shapes were tried [Bonferroni].
/// `residual`: what effects within groups leave, groups' offsets included. Empty where nothing stands out; coefficients are not filled.
std::vector<Effect> explainGroups(const Evidence& evidence, const Eigen::VectorXd& residual, const ExplainOptions& options);

/// Variance of rows by which coefficients of such effects are to be judged: by it a fit over rows gives them the error that as many
/// independent groups would. `freedom`: of the groups beside these effects.
double varianceOfGroups(const Evidence& evidence, const Eigen::VectorXd& residual, double freedom);

/// The offset of each group, drawn towards 0 by how much such offsets vary and how well each is known.
Eigen::VectorXd groupOffsets(const Evidence& evidence, const Eigen::VectorXd& residual);

}  // namespace toftwin::loop
