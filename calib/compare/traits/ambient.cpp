// SPDX-License-Identifier: Apache-2.0
// What light that is not the camera's own does to its ranges.
#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/least_squares.h"
#include "calib/compare/traits/repeats.h"
#include "calib/compare/traits/sessions.h"

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
  auto rows = finiteRows({ambient_klx, error_mm, sigma_mm, session.empty() ? error_mm : session}, 4, kOfAmbient);
  if (!rows) return rows.error();
  for (double& one : (*rows)[2]) one *= one;
  const AtPlaces at = session.empty() ? meansAtPlaces(std::move(*rows), 2) : asTheyAre(std::move(*rows));
  const auto &ambient = at.columns[0], &variance = at.columns[2];
  const Model straight = [&](std::span<const double> p, std::size_t i) { return p[0] + p[1] * ambient[i]; };
  const Column of_rows = session.empty() ? Column{} : Column{at.columns[3]};
  const auto bias = at.own[1].empty() ? fitBesideSessions(straight, at.columns[1], {0.0, 0.0}, ambient, of_rows)
                                      : fitMeans(straight, at.columns[1], at.own[1], {0.0, 0.0}, ambient),
             noise = std::ranges::max(variance) > 0.0 ? lineOfVariances(ambient, variance, at.own[2])
                                                      : fitLeastSquares(straight, variance, {0.0, 0.0});
  if (!bias || !noise) return undetermined(kOfAmbient, "all illuminances are alike");
  std::vector told{bias->trait("bias", "mm/klx", 1), noise->trait("noise²", "mm²/klx", 1)};
  if (!at.doubt.empty()) told[0].doubt = told[1].doubt = at.doubt;
  return told;
}

}  // namespace toftwin::compare
