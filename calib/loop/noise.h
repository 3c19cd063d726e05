// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/loop/evidence.h"

namespace toftwin::loop {

/// What rows scatter by, judged beside a model that is flexible along each covariate.
struct Noise {
  Eigen::VectorXd residual{};   ///< of the flexible model
  double scale = 1.0;           ///< robust deviation, in units of sigma
  Eigen::Index length = 1;      ///< rows apart from which rows of one group err independently
  double correlation = 0.0;     ///< of neighbouring rows
};
Noise judgeNoise(const Evidence& evidence, const Eigen::MatrixXd& model);

/// Hats along each covariate, names as levels: what smooth curves and names can say, at most a tenth of the rows in columns.
Eigen::MatrixXd flexibleColumns(const Evidence& evidence);
/// The same without what is one number in each group, which would say whatever groups' offsets do.
Eigen::MatrixXd flexibleWithinGroups(const Evidence& evidence);

/// Whether offsets of groups say more than one constant beside this model: the chance of it without any (F test).
double chanceOfGroups(const Evidence& evidence, const Eigen::MatrixXd& model);

/// All rows as one group. What is one number in each group stays marked so: rows of a group are no independent witnesses of it, whether
/// groups have offsets or not.
Evidence ungrouped(Evidence evidence);

}  // namespace toftwin::loop
