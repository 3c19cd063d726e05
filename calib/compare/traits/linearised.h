// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "calib/compare/traits/model.h"
#include "calib/compare/traits/traits.h"

namespace toftwin::compare {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// y − model, row by row.
VectorXd residuals(const Model& model, Column y, std::span<const double> p);
/// What each parameter, a column, does to each of so many rows of the model.
MatrixXd jacobian(const Model& model, std::size_t rows, std::vector<double> p);
/// Σ y².
double squaresOf(Column y);
/// Where so small a share of Σ y² is left, the rows are on an exact curve, and what is left is arithmetic's.
inline constexpr double kRoundingOfSquares = 1e-18;

}  // namespace toftwin::compare
