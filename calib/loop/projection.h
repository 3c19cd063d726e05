// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calib/loop/evidence.h"

namespace toftwin::loop {

/// Weighted rows without what the current model can explain: of a column x it leaves
///     √w x − (offsets of groups) − (what the columns of the model explain),
/// so that products of two such columns are efficient scores and their information.
class Projection {
 public:
  /// `weight`: of each row. `model`: the columns that are known already; groups' offsets are always projected out.
  Projection(const Evidence& evidence, const Eigen::VectorXd& weight, const Eigen::MatrixXd& model);

  [[nodiscard]] Eigen::MatrixXd operator()(Eigen::MatrixXd columns) const;
  /// How many numbers it takes out of the rows.
  [[nodiscard]] Eigen::Index rank() const { return basis_.cols() + static_cast<Eigen::Index>(sums_.size()); }

 private:
  void takeOffsets(Eigen::MatrixXd& scaled) const;

  Eigen::VectorXd root_weight_;
  std::vector<int> group_;
  std::vector<double> sums_;  ///< of the weights of each group
  Eigen::MatrixXd basis_;
};

/// Weights that a far row has less of: 1/σ² · min(1, 2/|z|), z the residual over σ and the residuals' own scale [Huber 1964].
Eigen::VectorXd robustWeights(const Eigen::VectorXd& residual, const Eigen::VectorXd& sigma);
/// 1.4826 times the median magnitude.
double robustScale(const Eigen::VectorXd& residual);
double robustScale(std::vector<double> values);
double median(std::vector<double> values);
/// Standard deviation about the mean.
double spreadOf(const Eigen::VectorXd& values);
/// The columns of both side by side.
Eigen::MatrixXd sideBySide(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// G⁺ of the Gram matrix G = XᵀX of columns of length 1. Directions whose eigenvalue is below 1e-11 of the largest count as none. Rounding
/// of the products leaves eigenvalues of up to a hundred columns uncertain by 100 ε = 2e-14 of the largest, a five-hundredth of that; and
/// along a direction at the limit a coefficient is right to ε/√1e-11 of the response, ten digits.
Eigen::MatrixXd pseudoInverse(const Eigen::MatrixXd& gram);

/// Coefficients of the least weighted squares of y over these columns beside groups' offsets, and what is left.
struct LeastSquares {
  Eigen::VectorXd coefficient{};
  Eigen::MatrixXd covariance{};  ///< for noise of variance 1/weight
  Eigen::VectorXd residual{};    ///< unweighted
};
LeastSquares leastSquares(const Evidence& evidence, const Eigen::VectorXd& y, const Eigen::VectorXd& weight,
                          const Eigen::MatrixXd& columns);
/// The same with robust weights, found by turns.
LeastSquares robustLeastSquares(const Evidence& evidence, const Eigen::VectorXd& y, const Eigen::MatrixXd& columns);

}  // namespace toftwin::loop
