// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sim/terms/term.h"

namespace toftwin::sim {

/// Values at knots of one covariate, or of each pair of knots of two: for the first x all y, then for the next x.
/// Linear (bilinear) between the knots and constant beyond them.
struct KnotTable {
  std::string over{};
  std::vector<double> knots{};
  std::string and_over{};  ///< empty: of one covariate
  std::vector<double> and_knots{};
};

/// The same as terms: of one covariate a curve; of two, for each knot of the first a hat times a curve over the second.
/// Nothing where the table is empty. Precondition: as many values as (pairs of) knots, which ascend.
std::vector<terms::Term> termsOf(const KnotTable& table, const std::vector<double>& values, terms::Quantity quantity);

/// `percent` of the light over squares of so many pixels' reach, one for each.
std::vector<terms::Term> termsOfSquares(const std::vector<double>& reaches_px, const std::vector<double>& percent);
/// The same over squares about the mirrored place; `right`, `down`: of the point mirrored about, from the principal point.
std::vector<terms::Term> termsOfMirroredSquares(const std::vector<double>& reaches_px, const std::vector<double>& percent,
                                                double right, double down);
/// values[j] in each column whose number is j modulo as many as there are.
std::vector<terms::Term> termsOfColumns(const std::vector<double>& values, terms::Quantity quantity);
/// Shares of a carrier of ranges (Across, Along, Around) over the amplitude.
std::vector<terms::Term> termsOfSmear(const std::vector<double>& amplitudes_e, const std::vector<double>& percent,
                                      terms::Carrier carrier);

}  // namespace toftwin::sim
