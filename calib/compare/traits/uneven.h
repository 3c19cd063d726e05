// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {

/// Rows that scatter more here than there: σ of each, of which the mean square is 1. ln σ is a parabola over the rows'
/// order by x, by maximum likelihood (A. C. Harvey, Econometrica 44 (1976) 461) of what a fit left of them. Empty where
/// neighbours' differences show it by no more than chance in 10 % (R. Koenker, J. Econometrics 17 (1981) 107), or of
/// fewer than ten rows to spare for each of its two numbers.
std::vector<double> unevenSigmas(Column left, Column x, std::size_t parameters);
/// The same whether or not they show it, as of rows that are off from what they share and miss no curve.
std::vector<double> sigmasOver(Column left, Column x, std::size_t parameters);
std::vector<double> over(Column values, Column sigmas);
/// A model of rows that are over their σ.
Model over(const Model& model, Column sigmas);
/// The fit's errors by what each row leaves, whatever its σ, so that σ that go otherwise than a parabola are in them,
/// too: r²/(1 − h), h what the row tells of itself, in the place of s², with Student's quantile of Satterthwaite's
/// degrees of freedom for each parameter (R. M. Bell, D. F. McCaffrey, Surv. Methodol. 28 (2002) 169, of rows that
/// are clusters of one).
void tellErrorsByRows(Fit& fit, const Model& model, Column y);
/// The same, of all parameters, where few rows tell one of them (under ten degrees of freedom), as the three at a
/// corner's edge do: what is told hangs on their own σ then, and so few do not show that it is another than the rest's.
void tellErrorsByRowsOfFew(Fit& fit, const Model& model, Column y);

}  // namespace toftwin::compare
