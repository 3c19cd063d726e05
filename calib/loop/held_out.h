// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calib/loop/evidence.h"

namespace toftwin::loop {

/// Losses of rows that a model was not fitted to, a sum for each block of rows: half of the squared residual in units of the
/// noise, growing linearly from two deviations on.
struct HeldOut {
  Eigen::VectorXd loss{};  ///< of each block
  Eigen::VectorXd left{};  ///< of each row, in units of the noise

  /// By how much another model loses more, and the standard error of that, over blocks.
  struct Gain {
    double mean = 0.0, error = 0.0;
  };
  [[nodiscard]] Gain over(const HeldOut& worse) const;
};

/// Ten folds of whole blocks, for several models over the same rows. Groups' offsets are known from all of their rows, so that only
/// what happens within groups counts. `scale`: deviation of the noise in units of sigma.
class Folds {
 public:
  Folds(const Evidence& evidence, const Eigen::VectorXd& y, const Eigen::VectorXd& weight, double scale);
  /// `shared` are columns of all models, given once.
  void share(const Eigen::MatrixXd& shared);
  [[nodiscard]] HeldOut with(const Eigen::MatrixXd& more) const;
  /// The same, where what is left may wander: blocks are predicted by the rows around them, too.
  [[nodiscard]] HeldOut wandering(const HeldOut& held) const;

 private:
  [[nodiscard]] Eigen::MatrixXd prepared(const Eigen::MatrixXd& columns) const;

  const Evidence& evidence_;
  Eigen::VectorXd root_weight_, y_;
  Eigen::MatrixXd shared_;
  double scale_;
  std::vector<int> fold_;  ///< of each row
};

}  // namespace toftwin::loop
