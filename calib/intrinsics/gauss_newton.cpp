// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/gauss_newton.h"

#include "calib/linear/linear.h"

namespace toftwin::intrinsics {
namespace {

constexpr double kStep = 1e-6;           // of the derivative
constexpr double kUndetermined = 1e-12;  // least over largest eigenvalue of scaled JᵀJ

}  // namespace

std::optional<Settled> settle(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& residuals,
                              Eigen::Index parameters) {
  Eigen::VectorXd at = Eigen::VectorXd::Zero(parameters);
  for (int round = 0; round < 50; ++round) {
    const Eigen::VectorXd r = residuals(at);
    if (!r.allFinite()) return std::nullopt;
    Eigen::MatrixXd j(r.size(), parameters);
    for (Eigen::Index k = 0; k < parameters; ++k) {
      Eigen::VectorXd above = at, below = at;
      above[k] += kStep;
      below[k] -= kStep;
      j.col(k) = (residuals(above) - residuals(below)) / (2.0 * kStep);
    }
    const Eigen::VectorXd scale = j.colwise().norm();
    if (!scale.allFinite() || scale.minCoeff() <= 0.0) return std::nullopt;
    const Eigen::MatrixXd unit = j * scale.cwiseInverse().asDiagonal();
    const auto [values, vectors] = linear::eigenpairs(unit.transpose() * unit);
    if (values.minCoeff() < kUndetermined * values.maxCoeff())
      return std::nullopt;
    const Eigen::MatrixXd inverse = linear::composed(vectors, values.cwiseInverse());
    const Eigen::MatrixXd covariance =
        scale.cwiseInverse().asDiagonal() * inverse * scale.cwiseInverse().asDiagonal();
    const Eigen::VectorXd step = -covariance * (j.transpose() * r);
    at += step;
    if (step.cwiseAbs().cwiseProduct(scale).maxCoeff() < 1e-7 * (1.0 + r.norm()))
      return Settled{at, covariance, residuals(at).squaredNorm()};
  }
  return std::nullopt;
}

}  // namespace toftwin::intrinsics
