// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/drift_models.h"

#include <cmath>
#include <utility>

#include "calib/compare/traits/decay_grid.h"

namespace toftwin::compare {
namespace {

using Row = std::span<const double>;

DriftCandidate constant() {
  return {DriftModel::Constant, [](Row p, double) { return p[0]; }, {0.0}, 1.0};
}

DriftCandidate ramp() {
  return {DriftModel::Ramp, [](Row p, double t) { return p[0] + p[1] * t; }, {0.0, 0.0}, 2.0};
}

DriftCandidate oneExponential(const DecayGrid& grid) {
  return {DriftModel::OneExponential, [](Row p, double t) { return p[0] + p[1] * decay(t, p[2]); },
          grid.one(), 3.0};
}

DriftCandidate twoExponentials(const DecayGrid& grid) {
  return {DriftModel::TwoExponentials,
          [](Row p, double t) { return p[0] + p[1] * decay(t, p[2]) + p[3] * decay(t, p[4]); }, grid.two(),
          5.0};
}

/// The step between two rows where it leaves the least; its place is searched, not fitted.
DriftCandidate step(Column t, Column y) {
  double total = 0.0;
  for (const double value : y) total += value;
  const double n = static_cast<double>(y.size());
  double before = 0.0, best = -1.0;
  std::size_t at = 1;
  for (std::size_t i = 1; i < y.size(); ++i) {
    before += y[i - 1];
    const double m = static_cast<double>(i), difference = (total - before) / (n - m) - before / m;
    if (const double between = difference * difference * m * (n - m); between > best) {
      best = between;
      at = i;
    }
  }
  const double place = 0.5 * (t[at - 1] + t[at]);
  return {DriftModel::Step,
          [place](Row p, double time) { return p[0] + (time > place ? p[1] : 0.0); },
          {0.0, 0.0},
          4.0};
}

/// Sums of the first rows: how much a split of rows explains of their squares is known without visiting them.
class Sums {
 public:
  explicit Sums(Column y) {
    for (const double one : y) sums_.push_back(sums_.back() + one);
  }
  /// Where rows of [from, to) are best split in two of at least kFewest each; `from` where there is no place.
  [[nodiscard]] std::size_t split(std::size_t from, std::size_t to) const {
    std::size_t best = from;
    double most = -1.0;
    for (std::size_t at = from + kFewest; at + kFewest <= to; ++at) {
      if (const double both = explained(from, at) + explained(at, to); both > most) most = both, best = at;
    }
    return best;
  }
  [[nodiscard]] double explained(std::size_t from, std::size_t to) const {
    const double sum = sums_[to] - sums_[from];
    return sum * sum / static_cast<double>(to - from);
  }
  [[nodiscard]] std::size_t rows() const { return sums_.size() - 1; }

 private:
  static constexpr std::size_t kFewest = 3;  // one row that is far off is no step there and back
  std::vector<double> sums_{0.0};
};

/// Two steps: each one's best place beside the other, in turns, from several places.
DriftCandidate twoSteps(Column t, Column y) {
  const Sums sums{y};
  const std::size_t n = sums.rows();
  std::size_t first = 0, second = 0;
  double most = -1.0;
  constexpr std::size_t kStarts = 16, kTurns = 10;
  for (std::size_t start = 0; start < kStarts; ++start) {
    std::size_t a = start * n / kStarts, b = a;
    for (std::size_t turn = 0; turn < kTurns; ++turn) {
      const auto before = std::pair{a, b};
      b = sums.split(a, n);
      a = sums.split(0, b);
      if (before == std::pair{a, b}) break;
    }
    if (a == 0 || b <= a) continue;
    const double both = sums.explained(0, a) + sums.explained(a, b) + sums.explained(b, n);
    if (both > most) most = both, first = a, second = b;
  }
  if (first == 0) return {.kind = DriftModel::TwoSteps};
  const double at_1 = 0.5 * (t[first - 1] + t[first]), at_2 = 0.5 * (t[second - 1] + t[second]);
  return {DriftModel::TwoSteps,
          [=](Row p, double time) {
            return p[0] + (time > at_1 ? p[1] : 0.0) + (time > at_2 ? p[2] : 0.0);
          },
          {0.0, 0.0, 0.0},
          7.0};
}

}  // namespace

DriftCandidates driftCandidates(Column t, Column y) {
  const DecayGrid grid{t, y};
  return {constant(), ramp(), oneExponential(grid), twoExponentials(grid), step(t, y), twoSteps(t, y)};
}

std::optional<Fit> fitOf(const DriftCandidate& candidate, Column t, Column y) {
  if (!candidate.shape) return std::nullopt;
  return fitLeastSquares(candidate.over(t), y, candidate.start);
}

bool isPlausible(const DriftCandidate& candidate, const Fit& fit, Column t) {
  if (candidate.kind != DriftModel::OneExponential && candidate.kind != DriftModel::TwoExponentials)
    return true;
  for (std::size_t k = 2; k < fit.at.size(); k += 2) {
    const double tau = std::exp(fit.at[k]);
    if (!(tau > shortestDecay(t)) || !(tau < kLongestDecay)) return false;
  }
  return true;
}

}  // namespace toftwin::compare
