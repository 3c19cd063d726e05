// SPDX-License-Identifier: Apache-2.0
// Errors that go straight with something: amplitude, speed.
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "calib/compare/traits/least_squares.h"
#include "calib/compare/traits/repeats.h"
#include "calib/compare/traits/sessions.h"

namespace toftwin::compare {
namespace {

/// y = p₀ + p₁ x, columns x, y and each row's session, if it is known.
std::optional<Fit> line(std::vector<std::vector<double>> columns, bool has_sessions) {
  const AtPlaces rows = has_sessions ? asTheyAre(std::move(columns)) : meansAtPlaces(std::move(columns), 2);
  const auto &x = rows.columns[0], &y = rows.columns[1];
  const Model straight = [&](std::span<const double> p, std::size_t i) { return p[0] + p[1] * x[i]; };
  auto fit = rows.own[1].empty() ? fitBesideSessions(straight, y, {0.0, 0.0}, x, has_sessions ? Column{rows.columns[2]} : Column{})
                                 : fitMeans(straight, y, rows.own[1], {0.0, 0.0}, x);
  if (fit && !rows.doubt.empty()) fit->doubt = rows.doubt;
  return fit;
}

}  // namespace

Traits amplitudeTraits(Column amplitude, Column error_mm, std::span<const std::size_t> group, Column session) {
  constexpr const char* kWhat = "amplitude-related error";
  std::vector<double> of(group.begin(), group.end());
  of.resize(amplitude.size(), 0.0);
  auto rows = finiteRows({amplitude, error_mm, of, session.empty() ? error_mm : session}, 4, kWhat);
  if (!rows) return rows.error();
  auto& x = (*rows)[0];
  if (std::ranges::min(x) <= 0.0) return undetermined(kWhat, "amplitudes must be positive");
  for (double& one : x) one = std::log10(one);
  std::map<double, std::size_t> number;
  for (const double one : (*rows)[2]) number.try_emplace(one, number.size());
  const std::size_t groups = number.size();
  // Each group's constant, then the slope.
  const Model model = [&](std::span<const double> p, std::size_t i) {
    return p[number[(*rows)[2][i]]] + p[groups] * x[i];
  };
  const auto fit = groups > 1 ? fitInOrder(model, (*rows)[1], std::vector<double>(groups + 1, 0.0), x)
                              : line({x, (*rows)[1], (*rows)[3]}, !session.empty());
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
  const auto rows = finiteRows({speed_m_per_s, error_mm, session.empty() ? error_mm : session}, 4, "motion artefact");
  if (!rows) return rows.error();
  const auto fit = line(*rows, !session.empty());
  if (!fit) return undetermined("motion artefact", "all speeds are alike");
  return std::vector{fit->trait("per speed", "mm/(m/s)", 1)};
}

}  // namespace toftwin::compare
