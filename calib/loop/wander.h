// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

namespace toftwin::loop {

/// Errors that go slowly from row to row: an autoregressive process beside white noise [Jones 1980]. A hypothesis like any other:
/// what it predicts of rows that it has not seen competes with what effects predict.
struct Wander {
  double slow = 0.0;   ///< variance of the process
  double keeps = 0.0;  ///< correlation of neighbouring rows of the process
  double white = 1.0;  ///< variance of the white noise
  double likelihood = 0.0;  ///< its logarithm, of the residuals that it was fitted to
};

/// The most likely one of these residuals, rows of a group following each other.
Wander fitWander(const Eigen::VectorXd& residual, const std::vector<int>& group);

/// What rows of a block should be by the rows before and after it, of each block.
Eigen::VectorXd predictBlocks(const Eigen::VectorXd& residual, const std::vector<int>& group, const std::vector<int>& block, const Wander& wander);

}  // namespace toftwin::loop
