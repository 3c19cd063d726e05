// SPDX-License-Identifier: Apache-2.0
// Errors that go straight with something: amplitude, ambient light, speed.
#include <algorithm>
#include <cmath>
#include <map>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {
namespace {

/// y = p₀ + p₁ x.
std::optional<Fit> line(const std::vector<double>& x, const std::vector<double>& y) {
  return fitLeastSquares([&](std::span<const double> p, std::size_t i) { return p[0] + p[1] * x[i]; }, y,
                         {0.0, 0.0});
}

}  // namespace

Traits amplitudeTraits(Column amplitude, Column error_mm, std::span<const std::size_t> group) {
  constexpr const char* kWhat = "amplitude-related error";
  std::vector<double> of(group.begin(), group.end());
  of.resize(amplitude.size(), 0.0);
  auto rows = finiteRows({amplitude, error_mm, of}, 4, kWhat);
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
  const auto fit = fitLeastSquares(model, (*rows)[1], std::vector<double>(groups + 1, 0.0));
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

Traits ambientTraits(Column ambient_klx, Column error_mm, Column sigma_mm) {
  auto rows = finiteRows({ambient_klx, error_mm, sigma_mm}, 4, "ambient-related error");
  if (!rows) return rows.error();
  auto& variance = (*rows)[2];
  for (double& one : variance) one *= one;
  const auto bias = line((*rows)[0], (*rows)[1]), noise = line((*rows)[0], variance);
  if (!bias || !noise) return undetermined("ambient-related error", "all illuminances are alike");
  return std::vector{bias->trait("bias", "mm/klx", 1), noise->trait("noise²", "mm²/klx", 1)};
}

Traits motionTraits(Column speed_m_per_s, Column error_mm) {
  const auto rows = finiteRows({speed_m_per_s, error_mm}, 4, "motion artefact");
  if (!rows) return rows.error();
  const auto fit = line((*rows)[0], (*rows)[1]);
  if (!fit) return undetermined("motion artefact", "all speeds are alike");
  return std::vector{fit->trait("per speed", "mm/(m/s)", 1)};
}

}  // namespace toftwin::compare
