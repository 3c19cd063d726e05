// SPDX-License-Identifier: Apache-2.0
#include "calib/linear/linear.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <limits>

namespace toftwin::linear {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Eigenpairs eigenpairs(const MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver{symmetric};
  return {solver.eigenvalues(), solver.eigenvectors()};
}

MatrixXd composed(const MatrixXd& vectors, const VectorXd& values) {
  const MatrixXd weighed = vectors * values.asDiagonal();
  return weighed * vectors.transpose();
}

VectorXd eigenvalues(const MatrixXd& symmetric) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>{symmetric, Eigen::EigenvaluesOnly}.eigenvalues();
}

Ldlt::Ldlt(const MatrixXd& symmetric) : factor_{symmetric} {}

VectorXd Ldlt::solve(const VectorXd& b) const { return factor_.solve(b); }

MatrixXd Ldlt::solveEach(const MatrixXd& b) const { return factor_.solve(b); }

MatrixXd Ldlt::inverse() const { return factor_.solve(MatrixXd::Identity(factor_.rows(), factor_.cols())); }

VectorXd Ldlt::pivots() const { return factor_.vectorD(); }

double Ldlt::rcond() const { return factor_.rcond(); }

MatrixXd choleskyOf(const MatrixXd& symmetric) {
  const Eigen::LLT<MatrixXd> factor{symmetric};
  if (factor.info() == Eigen::Success) return factor.matrixL();
  return MatrixXd::Constant(symmetric.rows(), symmetric.cols(), std::numeric_limits<double>::quiet_NaN());
}

VectorXd solveLower(const MatrixXd& lower, const VectorXd& b) { return lower.triangularView<Eigen::Lower>().solve(b); }

MatrixXd solveLowerEach(const MatrixXd& lower, const MatrixXd& b) {
  if (b.size() == 0) return b;  // Eigen's solver refers to the first number
  return lower.triangularView<Eigen::Lower>().solve(b);
}

MatrixXd leastSquares(const MatrixXd& a, const MatrixXd& b) { return a.colPivHouseholderQr().solve(b); }

MatrixXd basisOf(MatrixXd columns) {
  if (columns.size() == 0) return {columns.rows(), 0};  // of which Eigen's factorisation refers to the first column
  for (auto column : columns.colwise()) column /= std::max(column.norm(), 1e-300);
  Eigen::ColPivHouseholderQR<MatrixXd> factor(columns);
  factor.setThreshold(1e-8);
  return factor.householderQ() * MatrixXd::Identity(columns.rows(), factor.rank());
}

MatrixXd inverse(const MatrixXd& square) { return square.inverse(); }

}  // namespace toftwin::linear
