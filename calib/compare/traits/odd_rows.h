// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "calib/compare/traits/linearised.h"

namespace toftwin::compare {

/// Rows that are in all numbers of a fit, and why those are in doubt.
struct OddRows {
  std::vector<std::size_t> rows{};  ///< from 0, ascending
  std::string doubt{};              ///< empty: there are none
};

/// A few rows, such as slips of the pen, so far from what the others say as chance puts none in 999 of 1000
/// tables of normal errors (generalised extreme studentised deviates of rows each beside a fit of the others:
/// B. Rosner, Technometrics 25 (1983) 165; R. D. Cook, S. Weisberg, Residuals and Influence in Regression (1982)),
/// and which make a tenth of Σ r² or more. `left` are what the fit leaves of rows that stand so in their table, `x`
/// what they go with: where the others, or a row's neighbours, scatter more there, that counts. None where there are
/// fewer than twelve rows more than parameters.
OddRows oddRowsOf(const MatrixXd& jacobian, const VectorXd& left, Column x);
OddRows oddRowsOf(const Model& model, Column y, std::span<const double> at, Column x);

}  // namespace toftwin::compare
