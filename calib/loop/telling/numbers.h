// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/loop/explain.h"

namespace toftwin::loop {

/// A number of an effect that was fitted, with its standard error.
struct Number {
  std::string name{};    ///< "wavelength", "place"; of a coefficient its factors, "sine(range_mm, 342)"
  bool is_coefficient = false;
  double value = 0.0, error = 0.0;
  double freedom = 0.0;  ///< of the error: rows, or groups where it rests on these, beside what was fitted
  /// Half of the interval that holds the true value in 95 of 100 tables (Student's t), if the effect's shape is the true one.
  [[nodiscard]] double half() const;
};

/// Of each effect its coefficients, then its inner numbers that are fitted smoothly; not of places between two rows, nor of inner numbers
/// that come from a grid. All are of one fit by Gauss and Newton's columns; where neighbouring rows err alike, blocks of rows are the units
/// [Liang, Zeger 1986]. `length`: rows apart from which rows err independently.
std::vector<std::vector<Number>> numbersOf(const Evidence& evidence, const std::vector<Effect>& effects, Eigen::Index length);

}  // namespace toftwin::loop
