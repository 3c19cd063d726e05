// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace toftwin::table {

/// One small table as one tool writes it: 60 rows of time, reference, measured value and temperature.
struct Dialect {
  std::string name{};
  std::string bytes{};
};

/// The same numbers in some forty dialects. Columns are called time_s, reference_mm, measured_mm,
/// temperature_c, or mean that; times are 0 to 590 s or a date that begins so.
std::vector<Dialect> dialects();

/// The numbers.
struct SmallRow {
  double time_s, reference_mm, measured_mm, temperature_c;
};
std::vector<SmallRow> smallTable();

}  // namespace toftwin::table
