// SPDX-License-Identifier: Apache-2.0
// Errors that go straight with something: amplitude, speed.
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "calib/compare/traits/least_squares.h"
#include "calib/compare/traits/placed_rows.h"

namespace toftwin::compare {
namespace {

/// y = p₀ + p₁ x, columns x and y.
std::optional<Fit> line(RowsOfSessions columns) {
  const PlacedRows rows{std::move(columns), 2};
  const auto& x = rows.column(0);
  return rows.fit([&](std::span<const double> p, std::size_t i) { return p[0] + p[1] * x[i]; }, 1, {0.0, 0.0});
}

}  // namespace

Traits amplitudeTraits(Column amplitude, Column error_mm, std::span<const std::size_t> group, Column session) {
  constexpr const char* kWhat = "amplitude-related error";
  std::vector<double> of(group.begin(), group.end());
  of.resize(amplitude.size(), 0.0);
  auto rows = finiteRowsOf({amplitude, error_mm, of}, session, 4, kWhat);
  if (!rows) return rows.error();
  auto &x = rows->columns[0], &error = rows->columns[1];
  const auto& groups_of = rows->columns[2];
  if (std::ranges::min(x) <= 0.0) return undetermined(kWhat, "amplitudes must be positive");
  for (double& one : x) one = std::log10(one);
  std::map<double, std::size_t> number;
  for (const double one : groups_of) number.try_emplace(one, number.size());
  const std::size_t groups = number.size();
  // Each group's constant, then the slope.
  const Model model = [&](std::span<const double> p, std::size_t i) {
    return p[number[groups_of[i]]] + p[groups] * x[i];
  };
  const auto fit = groups > 1 ? fitInOrder(model, error, std::vector<double>(groups + 1, 0.0), x)
                              : line({.columns = {x, error}, .session = rows->session});
  if (!fit) {
    return undetermined(kWhat, groups > 1
                                   ? "within each distance all amplitudes are alike, or there are too few"
                                   : "all amplitudes are alike");
  }
  const Trait slope = fit->trait("per decade", "mm", groups);
  if (groups > 1) return std::vector{slope};
  Trait at_1 = fit->trait("at 1", "mm", 0);
  at_1.is_extrapolated = true;
  return std::vector{at_1, slope};
}

Traits motionTraits(Column speed_m_per_s, Column error_mm, Column session) {
  auto rows = finiteRowsOf({speed_m_per_s, error_mm}, session, 4, "motion artefact");
  if (!rows) return rows.error();
  const auto fit = line(*std::move(rows));
  if (!fit) return undetermined("motion artefact", "all speeds are alike");
  return std::vector{fit->trait("per speed", "mm/(m/s)", 1)};
}

}  // namespace toftwin::compare
