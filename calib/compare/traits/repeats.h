// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "calib/compare/traits/traits.h"

namespace toftwin::compare {

/// Where rows of a table stand: several readings of one place share what is off there (the place itself, what the
/// camera errs by at it), and are not as many independent rows.
struct SharedPlaces {
  std::vector<std::size_t> of{};  ///< each row's, by ascending abscissa
  std::size_t count = 0;
  /// Two rows or more for each place. Fewer are rounded alike by chance.
  [[nodiscard]] bool areShared() const { return count > 0 && 2 * count <= of.size(); }
};
/// A row that is not finite is of any place: no number is from it.
SharedPlaces sharedPlacesOf(Column x);

/// Columns, the first of which is the abscissa, with one row for each place: the mean of its rows. As they are where
/// rows share no places; or where places are too few to tell so many parameters and how places differ, and `doubt`
/// says so then.
struct AtPlaces {
  std::vector<std::vector<double>> columns{};
  std::string doubt{};
};
AtPlaces meansAtPlaces(std::vector<std::vector<double>> columns, std::size_t parameters);
/// So few places are too few to say how uncertain a number is that they tell.
std::string doubtOfPlaces(std::size_t rows, std::size_t places);

}  // namespace toftwin::compare
