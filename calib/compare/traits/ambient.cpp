// SPDX-License-Identifier: Apache-2.0
// What light that is not the camera's own does to its ranges.
#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/least_squares.h"
#include "calib/compare/traits/placed_rows.h"

namespace toftwin::compare {
namespace {

constexpr const char* kOfAmbient = "ambient-related error";

/// Variances c + s E, each of which scatters in proportion to itself: of rows that are all weighted alike, the
/// noisiest would tell s, and its interval would be that of the mean row. Weights are of the line itself,
/// until it settles; those of the rows' own variances would pull it down.
std::optional<Fit> lineOfVariances(const std::vector<double>& ambient, const std::vector<double>& variance,
                                   std::vector<double> own) {
  constexpr int kRounds = 30;
  constexpr double kLeast = 0.05, kSettled = 1e-6;  // of the median: a line may cross 0, a variance not
  const double least = kLeast * quantile(variance, 0.5);
  std::vector<double> expected(variance.size(), 1.0), relative;
  const Model model = [&](std::span<const double> p, std::size_t i) {
    return (p[0] + p[1] * ambient[i]) / expected[i];
  };
  std::vector<double> at{0.0, 0.0};
  for (int round = 0; round < kRounds; ++round) {
    relative.clear();
    for (std::size_t i = 0; i < variance.size(); ++i) relative.push_back(variance[i] / expected[i]);
    const auto fit = fitLeastSquares(model, relative, at);
    if (!fit) return std::nullopt;
    at = fit->at;
    double moved = 0.0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const double now = std::max(at[0] + at[1] * ambient[i], least);
      moved = std::max(moved, std::abs(now / expected[i] - 1.0));
      expected[i] = now;
    }
    if (moved < kSettled) break;
  }
  relative.clear();
  for (std::size_t i = 0; i < variance.size(); ++i) relative.push_back(variance[i] / expected[i]);
  for (std::size_t i = 0; i < own.size(); ++i) own[i] /= expected[i];
  return fitMeans(model, relative, own, at, ambient);
}

}  // namespace

Traits ambientTraits(Column ambient_klx, Column error_mm, Column sigma_mm, Column session) {
  auto rows = finiteRowsOf({ambient_klx, error_mm, sigma_mm}, session, 4, kOfAmbient);
  if (!rows) return rows.error();
  auto& columns = rows->columns;
  for (double& one : columns[2]) one *= one;
  const AtPlaces scatter = meansAtPlaces({columns[0], columns[2]}, 2);  // it has no offset
  const PlacedRows range{{.columns = {columns[0], columns[1]}, .session = rows->session}, 2};
  const auto straightOver = [](const std::vector<double>& ambient) -> Model {
    return [&](std::span<const double> p, std::size_t i) { return p[0] + p[1] * ambient[i]; };
  };
  const auto &ambient = scatter.columns[0], &variance = scatter.columns[1];
  const auto bias = range.fit(straightOver(range.column(0)), 1, {0.0, 0.0});
  auto noise = std::ranges::max(variance) > 0.0 ? lineOfVariances(ambient, variance, scatter.own[1])
                                                : fitLeastSquares(straightOver(ambient), variance, {0.0, 0.0});
  if (!bias || !noise) return undetermined(kOfAmbient, "all illuminances are alike");
  if (!scatter.doubt.empty()) noise->doubt = scatter.doubt;
  return std::vector{bias->trait("bias", "mm/klx", 1), noise->trait("noise²", "mm²/klx", 1)};
}

}  // namespace toftwin::compare
