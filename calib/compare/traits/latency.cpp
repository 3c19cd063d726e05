// SPDX-License-Identifier: Apache-2.0
// How late a frame is.
#include <algorithm>
#include <cmath>
#include <optional>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {
namespace {

constexpr const char* kOfLatency = "latency";
constexpr std::size_t kFewestOfPath = 6;

/// Where something was at which time; linear between its rows, and not known beyond them.
struct KnownPath {
  const std::vector<double>&t, &place;

  [[nodiscard]] bool knows(double at) const { return at >= t.front() && at <= t.back(); }
  [[nodiscard]] double operator()(double at) const {
    const auto after = std::ranges::upper_bound(t, at);
    const std::size_t i =
        std::clamp<std::size_t>(static_cast<std::size_t>(after - t.begin()), 1, t.size() - 1);
    const double share = (at - t[i - 1]) / (t[i] - t[i - 1]);
    return place[i - 1] + share * (place[i] - place[i - 1]);
  }
};

/// The delay of a coarse search that leaves least of c + (1 + s) p(t − τ) and half of the rows within the path.
/// Motion that repeats itself has several such places; what goes against it (1 + s below a half) is none.
std::optional<double> coarseDelay(Column t, Column y, const KnownPath& path, double span) {
  constexpr double kLeastScale = 0.5;
  std::optional<double> best;
  double least = 0.0;
  for (int step = -100; step <= 100; ++step) {
    const double tau = span * step / 100.0;
    double n = 0.0, sy = 0.0, sp = 0.0, syy = 0.0, spp = 0.0, syp = 0.0;
    for (std::size_t i = 0; i < t.size(); ++i) {
      if (!path.knows(t[i] - tau)) continue;
      const double p = path(t[i] - tau);
      n += 1.0, sy += y[i], sp += p, syy += y[i] * y[i], spp += p * p, syp += y[i] * p;
    }
    if (n < std::max(4.0, 0.5 * static_cast<double>(t.size()))) continue;
    const double yy = syy - sy * sy / n, pp = spp - sp * sp / n, yp = syp - sy * sp / n;
    if (!(pp > 0.0) || yp < kLeastScale * pp) continue;
    const double left = (yy - yp * yp / pp) / (n - 3.0);
    if (best && left >= least) continue;
    least = left, best = tau;
  }
  return best;
}

/// Places from `low` to `high`.
struct Places {
  double low = 0.0, high = 0.0;
  [[nodiscard]] bool has(double place) const { return place >= low && place <= high; }
};

/// The largest way that a path goes up, or down for a sign of −1, from any of its places to a later one.
Places longestWay(Column place, double sign) {
  Places longest;
  double least = sign * place.front();
  for (const double one : place) {
    least = std::min(least, sign * one);
    if (sign * one - least > longest.high - longest.low) longest = {least, sign * one};
  }
  return sign > 0.0 ? longest : Places{-longest.high, -longest.low};
}

/// The places that a path passes in both directions.
Places bothWays(Column place) {
  const Places up = longestWay(place, 1.0), down = longestWay(place, -1.0);
  return {std::max(up.low, down.low), std::min(up.high, down.high)};
}

/// Rows of the measured motion, and the path's place at each less the delay.
struct Timed {
  std::vector<double> t{}, y{}, place{};

  void add(double time, double measured, double at) {
    t.push_back(time), y.push_back(measured), place.push_back(at);
  }
};

std::optional<Fit> fitDelay(const Timed& rows, const KnownPath& path, double from) {
  const Model model = [&](std::span<const double> p, std::size_t i) {
    return p[1] + (1.0 + p[2]) * path(rows.t[i] - p[0]);
  };
  return fitInOrder(model, rows.y, {from, 0.0, 0.0});
}

}  // namespace

Traits latencyTraits(Column time_s, Column measured, Column reference_time_s, Column reference) {
  const auto rows = finiteRows({time_s, measured}, kFewestOfPath, kOfLatency),
             known = finiteRows({reference_time_s, reference}, 2, "latency's reference");
  if (!rows) return rows.error();
  if (!known) return known.error();
  const auto &t = (*rows)[0], &y = (*rows)[1];
  const KnownPath path{(*known)[0], (*known)[1]};
  for (std::size_t i = 1; i < path.t.size(); ++i) {
    if (!(path.t[i] > path.t[i - 1])) return undetermined(kOfLatency, "the reference's times must ascend");
  }
  const double span = 0.25 * (path.t.back() - path.t.front());
  const auto best = coarseDelay(t, y, path, span);
  if (!best) return undetermined(kOfLatency, "nothing moves while both are seen, or the two move differently");
  // A row that a step of the search takes out again would make a jump: one step is kept away from both ends.
  const double margin = span / 100.0;
  Timed all, passed_twice;
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (path.knows(t[i] - *best - margin) && path.knows(t[i] - *best + margin))
      all.add(t[i], y[i], path(t[i] - *best));
  }
  if (all.y.size() < kFewestOfPath) return undetermined(kOfLatency, "too few rows are within the reference's times");
  // What a camera errs by the place, as by the light that comes from there, looks like a delay where the place
  // is passed one way only: going back, a delay is of the other sign, and the error is not.
  const Places both = bothWays(all.place);
  for (std::size_t i = 0; i < all.y.size(); ++i) {
    if (both.has(all.place[i])) passed_twice.add(all.t[i], all.y[i], all.place[i]);
  }
  constexpr const char* kOneWay =
      "what moves passes no place in both directions, and going one way only a delay looks like an error that "
      "goes with the place";
  if (passed_twice.y.size() < kFewestOfPath) return undetermined(kOfLatency, kOneWay);
  const auto fit = fitDelay(passed_twice, path, *best);
  if (!fit) return undetermined(kOfLatency, kOneWay);
  constexpr double kBeyondErrors = 10.0;  // the errors of places by themselves go to and fro by up to five of them
  const double error = std::sqrt(fit->squares / fit->degrees);
  if (!(both.high - both.low > kBeyondErrors * error))
    return undetermined(kOfLatency, "places err by so much that they do not show whether what moves comes back");
  return std::vector{fit->trait("latency", "ms", 0, 1e3)};
}

}  // namespace toftwin::compare
