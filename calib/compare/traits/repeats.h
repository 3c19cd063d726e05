// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {

/// Where rows of a table stand: several readings of one place share what is off there (the place itself, what the
/// camera errs by at it), and are not as many independent rows.
struct SharedPlaces {
  std::vector<std::size_t> of{};  ///< each row's, by ascending abscissa
  std::size_t count = 0;
  /// Two rows or more for each place. Fewer are rounded alike by chance.
  [[nodiscard]] bool areShared() const { return count > 0 && 2 * count <= of.size(); }
  /// To say how uncertain so many parameters are: Student's distribution of one degree of freedom has no mean.
  [[nodiscard]] bool areTooFewFor(std::size_t parameters) const { return count < parameters + 2; }
};
/// A row that is not finite is of any place: no number is from it.
SharedPlaces sharedPlacesOf(Column x);

/// Columns, the first of which is the abscissa, with one row for each place: the mean of its rows. As they are where
/// rows share no places; or where places are too few to tell so many parameters and how places differ, and `doubt`
/// says so then.
struct AtPlaces {
  std::vector<std::vector<double>> columns{};
  /// Of each column, σ of each place's mean by how rows of one place scatter, be it more here than there, and how many
  /// they are; empty where rows are as they are.
  std::vector<std::vector<double>> own{};
  std::string doubt{};
};
AtPlaces meansAtPlaces(std::vector<std::vector<double>> columns, std::size_t parameters);
/// Rows as they are.
AtPlaces asTheyAre(std::vector<std::vector<double>> columns);
/// fitInOrder() of means over x that have such an `own` σ, and are off by τ besides, of their place: the weight of
/// each is 1/(τ² + own²), with the τ² at which Σ r²/(τ² + own²) of the residuals is n − k (R. C. Paule, J. Mandel, J.
/// Res. Natl. Bur. Stand. 87 (1982) 377), and 0 where it is less without. How uncertain parameters are is by how
/// means scatter about the fit (G. Knapp, J. Hartung, Stat. Med. 22 (2003) 2693), so that alike places are as
/// fitInOrder() has them.
std::optional<Fit> fitMeans(const Model& model, Column y, Column own, const std::vector<double>& start, Column x);
/// So few places are too few to say how uncertain a number is that they tell.
std::string doubtOfPlaces(std::size_t rows, std::size_t places);

}  // namespace toftwin::compare
