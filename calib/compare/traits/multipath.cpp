// SPDX-License-Identifier: Apache-2.0
// Light that came by another way: corners, and a veil in the lens.
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <optional>
#include <set>

#include "calib/compare/statistics.h"
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

namespace {

/// By how much each row's range moves for a veil of 1, mm.
std::vector<double> slopesOf(const std::vector<double>& own, const std::vector<double>& plate,
                             const std::vector<double>& ratio, std::span<const double> frequency_hz) {
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
  return slope_mm;
}

/// error = c + s slope, of all captures but one.
std::optional<Fit> veilFit(const std::vector<double>& slope_mm, const std::vector<double>& error_mm,
                           const std::vector<std::size_t>& captures, std::optional<std::size_t> left_out) {
  std::vector<double> slopes, errors;
  for (std::size_t i = 0; i < captures.size(); ++i) {
    if (captures[i] != left_out) slopes.push_back(slope_mm[i]), errors.push_back(error_mm[i]);
  }
  return fitLeastSquares([&](std::span<const double> p, std::size_t i) { return p[0] + p[1] * slopes[i]; },
                         errors, {0.0, 0.0});
}

}  // namespace

Traits veilTraits(Column own_range_m, Column plate_range_m, Column plate_over_own, Column error_mm,
                  std::span<const double> frequency_hz, std::span<const std::size_t> cluster) {
  const std::vector<double> numbers(cluster.begin(), cluster.end());
  const auto rows =
      finiteRows({own_range_m, plate_range_m, plate_over_own, error_mm, numbers}, 8, "lens scatter");
  if (!rows) return rows.error();
  if (frequency_hz.empty() || !(std::ranges::min(frequency_hz) > 0.0))
    return undetermined("lens scatter", "the frames say no modulation frequency");
  const std::vector<double> slope_mm = slopesOf((*rows)[0], (*rows)[1], (*rows)[2], frequency_hz);
  const std::vector<std::size_t> captures((*rows)[4].begin(), (*rows)[4].end());
  const auto fit = veilFit(slope_mm, (*rows)[3], captures, std::nullopt);
  if (!fit) return undetermined("lens scatter", "the plate adds no light whose share could be told");
  std::vector<double> without;
  const std::set<std::size_t> all(captures.begin(), captures.end());
  for (const std::size_t left_out : all) {
    if (const auto part = veilFit(slope_mm, (*rows)[3], captures, left_out)) without.push_back(part->at[1]);
  }
  Trait veil = fit->trait("veil", "1", 1);
  // Fewer than three captures do not tell how captures differ.
  if (all.size() < 3 || without.size() < all.size()) return std::vector{veil};
  const double g = static_cast<double>(all.size()), sd = summarise(without).sd;
  const double half = studentT(g - 1.0) * (g - 1.0) / std::sqrt(g) * sd;
  veil.low = veil.value - half, veil.high = veil.value + half;
  return std::vector{veil};
}

Traits veilTraits(Column own_range_m, Column plate_range_m, Column plate_over_own, Column error_mm,
                  std::span<const double> frequency_hz) {
  const std::vector<std::size_t> one_capture(own_range_m.size(), 0);
  return veilTraits(own_range_m, plate_range_m, plate_over_own, error_mm, frequency_hz, one_capture);
}

}  // namespace toftwin::compare
