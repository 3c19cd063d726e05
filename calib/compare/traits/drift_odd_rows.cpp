// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/drift_odd_rows.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "calib/compare/traits/drift_models.h"

namespace toftwin::compare {
namespace {

std::vector<double> without(Column all, const std::vector<std::size_t>& rows) {
  std::vector<double> kept;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (std::ranges::find(rows, i) == rows.end()) kept.push_back(all[i]);
  return kept;
}

OddRows oddRowsBy(const DriftCandidate& model, const Fit& fit, Column t, Column y) {
  return oddRowsOf([&](std::span<const double> p, std::size_t i) { return model.shape(p, t[i]); }, y, fit.at, t);
}

struct Explained {
  OddRows odd{};
  double cost = 0.0;
};

/// The odd rows of one model, which is fitted to the others again until they are the same: what they make of it hides
/// some of them.
std::optional<Explained> explainedBy(std::size_t number, Column t, Column y) {
  OddRows odd;
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    const auto kept_t = without(t, odd.rows), kept_y = without(y, odd.rows);
    const DriftCandidates candidates = driftCandidates(kept_t, kept_y);
    const DriftCandidate& model = candidates[number];
    const auto fit = fitOf(model, kept_t, kept_y);
    if (!fit || !isPlausible(model, *fit, kept_t)) return std::nullopt;
    OddRows next = oddRowsBy(model, *fit, t, y);
    const bool are_same = next.rows == odd.rows;
    if (are_same || round + 1 < kRounds) odd = std::move(next);
    if (!are_same && round + 1 < kRounds) continue;
    const double n = static_cast<double>(y.size()),
                 parameters = model.cost + 2.0 * static_cast<double>(odd.rows.size());
    return Explained{std::move(odd), n * std::log(std::max(fit->squares, 1e-18 * n) / n) + parameters * std::log(n)};
  }
  return std::nullopt;
}

}  // namespace

OddRows oddRowsOfSeries(DriftModel fitted, const Fit& fit, Column t, Column y) {
  const DriftCandidates candidates = driftCandidates(t, y);
  const auto model = std::ranges::find(candidates, fitted, &DriftCandidate::kind);
  OddRows best = oddRowsBy(*model, fit, t, y);
  if (best.rows.empty()) return best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    auto one = explainedBy(i, t, y);
    if (!one || one->odd.rows.empty() || !(one->cost < least)) continue;
    least = one->cost, best = std::move(one->odd);
  }
  return best;
}

}  // namespace toftwin::compare
