// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/compare/traits/least_squares.h"
#include "calib/compare/traits/repeats.h"
#include "calib/compare/traits/sessions.h"

namespace toftwin::compare {

/// Finite rows of a table whose first column is the abscissa, for a fit of so many parameters. Of one session, rows
/// that share a place are their means (meansAtPlaces()). Of several, rows are as they are, each session has its
/// offset, and those of one place err alike (fitBesideSessions()).
class PlacedRows {
 public:
  PlacedRows(RowsOfSessions rows, std::size_t parameters);

  [[nodiscard]] const std::vector<double>& column(std::size_t number) const { return rows_.columns[number]; }
  [[nodiscard]] Column session() const { return session_; }
  /// Of one of the columns; the model's first parameter is its constant. In doubt where places are too few.
  [[nodiscard]] std::optional<Fit> fit(const Model& model, std::size_t of_column,
                                       const std::vector<double>& start) const;

 private:
  AtPlaces rows_{};
  std::vector<double> session_{};
  SharedPlaces places_{};  ///< of several sessions
};

}  // namespace toftwin::compare
