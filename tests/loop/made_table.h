// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "calib/table/readings.h"

/// Tables whose errors are known, for tests of the search.
namespace toftwin::testing {

/// What a made row knows of itself.
struct MadeRow {
  double reference_mm = 0.0, time_s = 0.0, ambient_klx = 0.0, column = 0.0, incidence_deg = 0.0;
  std::size_t number = 0;
};
/// The error of a row in mm, without noise.
using MadeError = std::function<double(const MadeRow&)>;
/// The noise of the next row in mm; unit is a draw of a standard normal.
using MadeNoise = std::function<double(const MadeRow&, double unit)>;

/// As CSV with headers reference_mm, measured_mm, time_s, ambient_klx, column, incidence_deg; equal seeds give equal tables.
std::string madeCsv(std::size_t rows, std::uint64_t seed, const MadeError& error, const MadeNoise& noise = [](const MadeRow&, double unit) { return 2.0 * unit; });
table::Readings madeReadings(std::size_t rows, std::uint64_t seed, const MadeError& error, const MadeNoise& noise = [](const MadeRow&, double unit) { return 2.0 * unit; });

}  // namespace toftwin::testing
