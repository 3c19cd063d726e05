// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calib/compare/traits/linearised.h"

namespace toftwin::compare {

/// Why a few rows, such as a slip of the pen, are in all numbers of a fit: rows so far from what the others
/// say as chance puts none in 999 of 1000 tables of normal errors (generalised extreme studentised deviates
/// of rows each beside a fit of the others: B. Rosner, Technometrics 25 (1983) 165; R. D. Cook, S. Weisberg,
/// Residuals and Influence in Regression (1982)), and which make a tenth of Σ r² or more. `left` are what the
/// fit leaves of rows that stand so in their table, `x` what they go with: where the others, or a row's
/// neighbours, scatter more there, that counts. Empty: there are none, or there are fewer than twelve rows
/// more than parameters.
std::string doubtOfOddRows(const MatrixXd& jacobian, const VectorXd& left, Column x);
std::string doubtOfOddRows(const Model& model, Column y, std::span<const double> at, Column x);

}  // namespace toftwin::compare
