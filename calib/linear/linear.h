// SPDX-License-Identifier: Apache-2.0
// Factorisations of matrices whose size is known when they come. Eigen's are templates that each file which calls them
// compiles anew, for seconds; here they are compiled once.
#pragma once

#include <Eigen/Cholesky>

namespace toftwin::linear {

/// A = V diag(values) Vᵀ of a symmetric A, of which the lower triangle is read. Values ascend; column i of `vectors`
/// is the unit vector of values[i].
struct Eigenpairs {
  Eigen::VectorXd values{};
  Eigen::MatrixXd vectors{};
};
Eigenpairs eigenpairs(const Eigen::MatrixXd& symmetric);
/// V diag(values) Vᵀ.
Eigen::MatrixXd composed(const Eigen::MatrixXd& vectors, const Eigen::VectorXd& values);
/// The same values alone, quicker.
Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& symmetric);

/// A = Pᵀ L D Lᵀ P of a symmetric A, definite or not, of which the lower triangle is read.
class Ldlt {
 public:
  Ldlt() = default;
  explicit Ldlt(const Eigen::MatrixXd& symmetric);

  /// A⁻¹ b, and A⁻¹ B. Where a pivot is 0, so is that part of it.
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& b) const;
  [[nodiscard]] Eigen::MatrixXd solveEach(const Eigen::MatrixXd& b) const;
  [[nodiscard]] Eigen::MatrixXd inverse() const;
  /// D's diagonal.
  [[nodiscard]] Eigen::VectorXd pivots() const;
  /// An estimate of the reciprocal condition.
  [[nodiscard]] double rcond() const;

 private:
  Eigen::LDLT<Eigen::MatrixXd> factor_{};
};

/// L of A = L Lᵀ, lower triangular, of which A's lower triangle is read; NaN if A is not positive definite.
Eigen::MatrixXd choleskyOf(const Eigen::MatrixXd& symmetric);

/// L⁻¹ b, and L⁻¹ B, of a lower triangular L.
Eigen::VectorXd solveLower(const Eigen::MatrixXd& lower, const Eigen::VectorXd& b);
Eigen::MatrixXd solveLowerEach(const Eigen::MatrixXd& lower, const Eigen::MatrixXd& b);

/// The X of least |A X − B|², columns by themselves.
Eigen::MatrixXd leastSquares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// An orthonormal basis of what the columns span; a column that is the others' but for 1e-8 of its length adds none.
Eigen::MatrixXd basisOf(Eigen::MatrixXd columns);

/// A⁻¹ of a square A; if it has none, what comes need not be finite.
Eigen::MatrixXd inverse(const Eigen::MatrixXd& square);

}  // namespace toftwin::linear
