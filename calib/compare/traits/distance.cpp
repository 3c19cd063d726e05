// SPDX-License-Identifier: Apache-2.0
// What goes with distance: harmonics and wraps.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {
namespace {

constexpr double kLight_m_per_s = 299'792'458.0;

struct Wave {
  double per_m = 0.0;  ///< radians per metre of distance
  std::string name{};
};

std::vector<Wave> wavesOf(std::span<const double> frequency_hz, std::span<const int> orders) {
  std::vector<Wave> waves;
  for (const double f : frequency_hz) {
    for (const int k : orders) {
      waves.push_back({2.0 * std::numbers::pi * k * 2.0 * f / kLight_m_per_s,
                       fmt::format("{:.6g} MHz, {} per period", f * 1e-6, k)});
    }
  }
  return waves;
}

}  // namespace

Traits harmonicTraits(Column distance_m, Column error_mm, std::span<const double> frequency_hz,
                      std::span<const int> orders) {
  const std::vector<Wave> waves = wavesOf(frequency_hz, orders);
  if (waves.empty()) return undetermined("harmonics", "no frequency or order was given");
  const auto rows = finiteRows({distance_m, error_mm}, 2 * waves.size() + 4, "harmonics");
  if (!rows) return rows.error();
  const auto &d = (*rows)[0], &e = (*rows)[1];
  const Model model = [&](std::span<const double> p, std::size_t i) {
    double sum = p[0] + p[1] * d[i];
    for (std::size_t w = 0; w < waves.size(); ++w)
      sum += p[2 + 2 * w] * std::cos(waves[w].per_m * d[i]) + p[3 + 2 * w] * std::sin(waves[w].per_m * d[i]);
    return sum;
  };
  const auto fit = fitLeastSquares(model, e, std::vector<double>(2 + 2 * waves.size(), 0.0));
  if (!fit)
    return undetermined("harmonics", "the distances span too little of a period, or two orders coincide");
  std::vector<Trait> traits;
  for (std::size_t w = 0; w < waves.size(); ++w) {
    // At a zero amplitude the direction has no derivative: a small number keeps it finite, and the interval
    // ends at 0.
    Trait one = fit->trait(waves[w].name, "mm",
                           [w](std::span<const double> p) { return std::hypot(p[2 + 2 * w], p[3 + 2 * w]); });
    one.low = std::max(0.0, one.low);
    traits.push_back(std::move(one));
  }
  traits.push_back(fit->trait("scale", "mm/m", 1));
  const double sd = std::sqrt(fit->squares / fit->degrees), half = 1.96 / std::sqrt(2.0 * fit->degrees);
  traits.push_back({.name = "residual",
                    .unit = "mm",
                    .value = sd,
                    .low = sd * std::exp(-half),
                    .high = sd * std::exp(half),
                    .n = fit->n});
  return traits;
}

Traits wrapTraits(Column error_m, double period_m) {
  if (!(period_m > 0.0)) return undetermined("wraps", "the period must be a positive length");
  const auto rows = finiteRows({error_m}, 1, "wraps");
  if (!rows) return rows.error();
  const auto& errors = rows->front();
  const auto wrapped =
      std::ranges::count_if(errors, [&](double e) { return std::round(e / period_m) != 0.0; });
  return std::vector{shareTrait("wrapped", static_cast<std::size_t>(wrapped), errors.size())};
}

}  // namespace toftwin::compare
