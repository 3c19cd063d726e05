// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>

#include <Eigen/Core>

namespace toftwin::intrinsics {

/// Where Σ residual² is least, as steps of the parameters from where they are at 0.
struct Settled {
  Eigen::VectorXd step;
  Eigen::MatrixXd covariance;  ///< (JᵀJ)⁻¹ there, for residuals of unit variance
  double squares = 0.0;
};

/// Gauss and Newton with a numeric Jacobian, for few parameters of order 1. Nothing if it does not settle, or
/// if the residuals leave a parameter undetermined.
std::optional<Settled> settle(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& residuals,
                              Eigen::Index parameters);

}  // namespace toftwin::intrinsics
