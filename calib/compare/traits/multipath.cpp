// SPDX-License-Identifier: Apache-2.0
// Light that came by another way: corners, and a veil in the lens.
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {

Traits cornerTraits(Column distance_to_edge_m, Column error_mm) {
  const auto rows = finiteRows({distance_to_edge_m, error_mm}, 8, "corner");
  if (!rows) return rows.error();
  const auto &x = (*rows)[0], &e = (*rows)[1];
  const double reach = std::ranges::max(x);
  if (!(reach > 0.0) || std::ranges::min(x) < 0.0)
    return undetermined("corner", "distances to the edge must not be negative");
  const Model model = [&](std::span<const double> p, std::size_t i) {
    return p[0] + p[1] * std::exp(-x[i] / (reach * std::exp(p[2])));
  };
  std::optional<Fit> fit;
  for (const double share : {0.1, 0.3, 1.0}) {
    auto tried = fitLeastSquares(model, e, {0.0, 1.0, std::log(share)});
    if (tried && (!fit || tried->squares < fit->squares)) fit = std::move(tried);
  }
  if (!fit) return undetermined("corner", "the error does not fall off from the edge");
  Trait length = fit->trait("reach", "m", 2);
  for (double* value : {&length.value, &length.low, &length.high}) *value = reach * std::exp(*value);
  return std::vector{fit->trait("at the edge", "mm", 1), length, fit->trait("far from it", "mm", 0)};
}

Traits scatterTraits(Column own_range_m, Column plate_range_m, Column plate_over_own, Column error_mm,
                     double frequency_hz) {
  const auto rows = finiteRows({own_range_m, plate_range_m, plate_over_own, error_mm}, 3, "lens scatter");
  if (!rows) return rows.error();
  if (!(frequency_hz > 0.0)) return undetermined("lens scatter", "the modulation frequency must be positive");
  const auto &own = (*rows)[0], &plate = (*rows)[1], &ratio = (*rows)[2], &error = (*rows)[3];
  const double radians_per_m = 4.0 * std::numbers::pi * frequency_hz / 299'792'458.0;
  const Model model = [&](std::span<const double> p, std::size_t i) {
    const double nearer = radians_per_m * (plate[i] - own[i]);
    return 1e3 * std::arg(1.0 + std::polar(p[0] * ratio[i], nearer)) / radians_per_m;
  };
  const auto fit = fitLeastSquares(model, error, {0.0});
  if (!fit) return undetermined("lens scatter", "the plate is as far as what lies behind, or adds no light");
  return std::vector{fit->trait("veil", "1", 0)};
}

Traits veilTraits(Column own_range_m, Column plate_range_m, Column plate_over_own, Column error_mm,
                  std::span<const double> frequency_hz) {
  const auto rows = finiteRows({own_range_m, plate_range_m, plate_over_own, error_mm}, 8, "lens scatter");
  if (!rows) return rows.error();
  if (frequency_hz.empty() || !(std::ranges::min(frequency_hz) > 0.0))
    return undetermined("lens scatter", "the frames say no modulation frequency");
  const auto &own = (*rows)[0], &plate = (*rows)[1], &ratio = (*rows)[2], &error = (*rows)[3];
  std::vector<double> slope_mm;
  for (std::size_t i = 0; i < own.size(); ++i) {
    double sum = 0.0, weights = 0.0;
    for (const double f : frequency_hz) {
      const double radians_per_m = 4.0 * std::numbers::pi * f / 299'792'458.0;
      sum += f * f * std::sin(radians_per_m * (plate[i] - own[i])) / radians_per_m;
      weights += f * f;
    }
    slope_mm.push_back(1e3 * ratio[i] * sum / weights);
  }
  const auto fit = fitLeastSquares(
      [&](std::span<const double> p, std::size_t i) { return p[0] + p[1] * slope_mm[i]; }, error, {0.0, 0.0});
  if (!fit) return undetermined("lens scatter", "the plate adds no light whose share could be told");
  return std::vector{fit->trait("veil", "1", 1)};
}

}  // namespace toftwin::compare
