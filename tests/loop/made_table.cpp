// SPDX-License-Identifier: Apache-2.0
#include "tests/loop/made_table.h"

#include <cmath>
#include <random>
#include <stdexcept>

#include <fmt/format.h>

namespace toftwin::testing {

std::string madeCsv(std::size_t rows, std::uint64_t seed, const MadeError& error, const MadeNoise& noise) {
  std::mt19937_64 random{seed};
  std::normal_distribution<double> normal;
  const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>{low, high}(random); };
  std::string csv = "reference_mm,measured_mm,time_s,ambient_klx,column,incidence_deg\n";
  for (std::size_t i = 0; i < rows; ++i) {
    const MadeRow row{.reference_mm = between(600.0, 4500.0), .time_s = 1.5 * static_cast<double>(i), .ambient_klx = between(0.5, 60.0),
                      .column = std::floor(between(0.0, 224.0)), .incidence_deg = between(0.0, 65.0), .number = i};
    const double measured = row.reference_mm + error(row) + noise(row, normal(random));
    csv += fmt::format("{:.4f},{:.4f},{},{:.3f},{},{:.3f}\n", row.reference_mm, measured, row.time_s, row.ambient_klx, row.column, row.incidence_deg);
  }
  return csv;
}

table::Readings madeReadings(std::size_t rows, std::uint64_t seed, const MadeError& error, const MadeNoise& noise) {
  auto readings = table::parseReadings(madeCsv(rows, seed, error, noise), {}, "made.csv");
  if (!readings) throw std::runtime_error{readings.error().message};
  return *std::move(readings);
}

}  // namespace toftwin::testing
