// SPDX-License-Identifier: Apache-2.0
// What is left of the frames before, and how late a frame is.
#include <algorithm>
#include <cmath>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {

Traits lagTraits(Column frames_after, Column value) {
  const auto rows = finiteRows({frames_after, value}, 5, "lag");
  if (!rows) return rows.error();
  const auto &k = (*rows)[0], &y = (*rows)[1];
  if (std::ranges::min(k) < 0.0) return undetermined("lag", "frames are counted from the change of light on");
  const Model model = [&](std::span<const double> p, std::size_t i) {
    return p[0] + p[1] * std::pow(std::max(p[2], 1e-9), k[i]);
  };
  std::optional<Fit> fit;
  for (const double lambda : {0.05, 0.3, 0.8}) {
    auto tried = fitLeastSquares(model, y, {y.back(), y.front() - y.back(), lambda});
    if (tried && (!fit || tried->squares < fit->squares)) fit = std::move(tried);
  }
  if (!fit || !(fit->at[2] > 0.0) || !(fit->at[2] < 1.0))
    return undetermined("lag", "nothing dies away after the change");
  return std::vector{fit->trait("lag", "1", 2), fit->trait("rest", "", 0)};
}

Traits afterImageTraits(Column first, Column rest, Column before, const char* name) {
  const auto rows = finiteRows({first, rest, before}, 2, "lag");
  if (!rows) return rows.error();
  std::vector<double> shares;
  for (std::size_t i = 0; i < rows->front().size(); ++i) {
    const double change = (*rows)[2][i] - (*rows)[1][i];
    // A change of less than a tenth tells little of a share of it.
    if (std::abs(change) > 0.1 * std::abs((*rows)[1][i])) shares.push_back(((*rows)[0][i] - (*rows)[1][i]) / change);
  }
  if (shares.size() < 2) return undetermined("lag", "the light hardly changed");
  return std::vector{meanTrait(name, "1", shares)};
}

namespace {

double between(const std::vector<double>& t, const std::vector<double>& y, double at) {
  const auto after = std::ranges::upper_bound(t, at);
  const std::size_t i = std::clamp<std::size_t>(static_cast<std::size_t>(after - t.begin()), 1, t.size() - 1);
  const double share = (at - t[i - 1]) / (t[i] - t[i - 1]);
  return y[i - 1] + share * (y[i] - y[i - 1]);
}

}  // namespace

Traits latencyTraits(Column time_s, Column measured, Column reference_time_s, Column reference) {
  const auto rows = finiteRows({time_s, measured}, 6, "latency"),
             known = finiteRows({reference_time_s, reference}, 2, "latency's reference");
  if (!rows) return rows.error();
  if (!known) return known.error();
  const auto &t = (*rows)[0], &y = (*rows)[1], &rt = (*known)[0], &ry = (*known)[1];
  for (std::size_t i = 1; i < rt.size(); ++i) {
    if (!(rt[i] > rt[i - 1])) return undetermined("latency", "the reference's times must ascend");
  }
  // Motion that repeats itself has several best places: a coarse search finds the best of them. The reference is
  // not extended: a delay is looked for that leaves half of the rows within it, and the fit is of those alone.
  const double span = 0.25 * (rt.back() - rt.front());
  const auto isKnown = [&](double at) { return at >= rt.front() && at <= rt.back(); };
  double best = 0.0, least = -1.0;
  for (int s = -100; s <= 100; ++s) {
    const double tau = span * s / 100.0;
    double sum = 0.0, squares = 0.0, n = 0.0;
    for (std::size_t i = 0; i < t.size(); ++i) {
      if (!isKnown(t[i] - tau)) continue;
      const double e = y[i] - between(rt, ry, t[i] - tau);
      sum += e;
      squares += e * e;
      n += 1.0;
    }
    if (n < std::max(3.0, 0.5 * static_cast<double>(t.size()))) continue;
    const double left = (squares - sum * sum / n) / (n - 2.0);
    if (least >= 0.0 && left >= least) continue;
    least = left;
    best = tau;
  }
  if (least < 0.0) return undetermined("latency", "the reference's times hold fewer than half of the rows");
  // A row that a step of the search takes out again would make a jump: one step is kept away from both ends.
  const double margin = span / 100.0;
  std::vector<double> at_time, seen;
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (isKnown(t[i] - best - margin) && isKnown(t[i] - best + margin))
      at_time.push_back(t[i]), seen.push_back(y[i]);
  }
  const Model model = [&](std::span<const double> p, std::size_t i) {
    return between(rt, ry, at_time[i] - p[0]) + p[1];
  };
  const auto fit = fitLeastSquares(model, seen, {best, 0.0});
  if (!fit) return undetermined("latency", "nothing moves");
  return std::vector{fit->trait("latency", "ms", 0, 1e3)};
}

}  // namespace toftwin::compare
