// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "calib/loop/explain.h"

namespace toftwin::loop {

/// What the offsets of sessions or captures go with, of the covariates that are one number in each. Few groups are little
/// information, not none: the test is Student's of what is left between groups, times how many shapes were tried [Bonferroni].
/// `residual`: what effects within groups leave, groups' offsets included. Nothing where no shape stands out.
std::optional<Effect> explainGroups(const Evidence& evidence, const Eigen::VectorXd& residual, double alpha);

/// The offset of each group, drawn towards 0 by how much such offsets vary and how well each is known.
Eigen::VectorXd groupOffsets(const Evidence& evidence, const Eigen::VectorXd& residual);

}  // namespace toftwin::loop
