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
  const Model model = [&](std::span<const double> p, std::size_t i) {
    return between(rt, ry, t[i] - p[0]) + p[1];
  };
  // Motion that repeats itself has several best places: a coarse search finds the best of them.
  const double span = 0.25 * (rt.back() - rt.front());
  double best = 0.0, least = -1.0;
  for (int s = -100; s <= 100; ++s) {
    const double tau = span * s / 100.0;
    double sum = 0.0, squares = 0.0;
    for (std::size_t i = 0; i < t.size(); ++i) {
      const double e = y[i] - between(rt, ry, t[i] - tau);
      sum += e;
      squares += e * e;
    }
    const double n = static_cast<double>(t.size()), left = squares - sum * sum / n;
    if (least >= 0.0 && left >= least) continue;
    least = left;
    best = tau;
  }
  const auto fit = fitLeastSquares(model, y, {best, 0.0});
  if (!fit) return undetermined("latency", "nothing moves");
  return std::vector{fit->trait("latency", "ms", 0, 1e3)};
}

}  // namespace toftwin::compare
