// SPDX-License-Identifier: Apache-2.0
// What goes with distance: harmonics and wraps.
#include <fmt/format.h>
#include <toftwin/units.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <set>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/clusters.h"
#include "calib/compare/traits/phasor.h"
#include "calib/compare/traits/waves.h"

namespace toftwin::compare {
namespace {

/// Fewer rows for each parameter of a fit tell little more than themselves.
constexpr std::size_t kRowsPerParameter = 3;

/// Of two parameters from `first` on: the delta method far from 0, amplitudeOf() near it.
Trait amplitudeTrait(const Fit& fit, const std::string& name, std::size_t first) {
  const double sigma = std::sqrt(0.5 * (std::pow(fit.error(first), 2) + std::pow(fit.error(first + 1), 2)));
  const WaveParts phasor{fit.at[first], fit.at[first + 1], sigma, fit.degrees};
  Trait trait = fit.trait(name, "mm",
                          [first](std::span<const double> p) { return std::hypot(p[first], p[first + 1]); });
  if (isNearNothing(phasor)) {
    const Trait near = amplitudeOf(phasor);
    trait.low = near.low, trait.high = near.high;
  }
  trait.refers_to = phasor;
  return trait;
}

OnLine lineOf(const Fit& fit, Column distance_m, double at_m) {
  const std::size_t k = fit.at.size();
  const double c = fit.covariance[0], both = fit.covariance[1], slope = fit.covariance[k + 1];
  const auto [nearest, farthest] = std::ranges::minmax(distance_m);
  return {.at_m = at_m,
          .from_m = nearest,
          .to_m = farthest,
          .slope = fit.at[1],
          .variance = c + 2.0 * at_m * both + at_m * at_m * slope,
          .slope_variance = slope,
          .covariance = both + at_m * slope,
          .degrees = fit.degrees};
}

/// Waves, what is left of a line c + s d at the rows' mean distance and its slope, and what no wave explains.
std::vector<Trait> traitsOf(const Fit& fit, const std::vector<Wave>& waves, Column distance_m) {
  std::vector<Trait> traits;
  for (std::size_t w = 0; w < waves.size(); ++w) {
    traits.push_back(amplitudeTrait(fit, waves[w].name, 2 + 2 * w));
  }
  // Not c: nobody measured at distance 0, and c is the less certain the farther the rows are from it.
  const double mean_m = summarise(distance_m).mean;
  traits.push_back(
      fit.trait("offset", "mm", [mean_m](std::span<const double> p) { return p[0] + p[1] * mean_m; }));
  traits.back().refers_to = lineOf(fit, distance_m, mean_m);
  traits.push_back(fit.trait("scale", "mm/m", 1));
  const double free = static_cast<double>(fit.n - fit.at.size());
  const double sd = std::sqrt(fit.squares / free), half = 1.96 / std::sqrt(2.0 * free);
  traits.push_back({.name = "residual",
                    .unit = "mm",
                    .value = sd,
                    .low = sd * std::exp(-half),
                    .high = sd * std::exp(half),
                    .n = fit.n});
  return traits;
}

/// c + s d + Σ a cos + b sin, for a distance in metres.
double seriesAt(std::span<const double> p, const std::vector<Wave>& waves, double d) {
  double sum = p[0] + p[1] * d;
  for (std::size_t w = 0; w < waves.size(); ++w)
    sum += p[2 + 2 * w] * std::cos(waves[w].per_m * d) + p[3 + 2 * w] * std::sin(waves[w].per_m * d);
  return sum;
}

FittedTraits fittedOf(const Fit& fit, const std::vector<Wave>& waves, Column distance_m) {
  return {.traits = traitsOf(fit, waves, distance_m),
          .curve = {fmt::format("a line and {} waves", waves.size()),
                    [=, p = fit.at](double d) { return seriesAt(p, waves, d); }}};
}

/// In the order in which they are looked for: the first to be left out is the last.
constexpr std::array kOrders{4, 3, 6, 2, 1};

/// Which of kOrders are not among the first `told`, and why: the rows span too little of the longest period,
/// or are too few, or scatter too much.
std::string ordersNotTold(std::size_t told, const std::vector<double>& distance_m,
                          std::span<const double> frequency_hz) {
  if (told == kOrders.size()) return {};
  std::string orders;
  for (std::size_t i = told; i < kOrders.size(); ++i)
    orders += fmt::format("{}{}", i == told ? "" : i + 1 == kOrders.size() ? " and " : ", ", kOrders[i]);
  const double lowest_hz = std::ranges::min(frequency_hz), period_m = kSpeedOfLight_m_per_s / 2.0 / lowest_hz;
  const auto [nearest, farthest] = std::ranges::minmax(distance_m);
  const std::size_t needed = kRowsPerParameter * (2 + 2 * frequency_hz.size() * kOrders.size());
  std::string why;
  if (farthest - nearest < period_m) {
    why = fmt::format(
        "the distances, {:.3g} to {:.3g} m, are {:.2f} of the period of {:.6g} MHz, {:.3g} m; up "
        "to {:.3g} m they would cover it",
        nearest, farthest, (farthest - nearest) / period_m, lowest_hz * 1e-6, period_m, nearest + period_m);
  } else if (distance_m.size() < needed) {
    why = fmt::format("there are {} rows, and it takes {}", distance_m.size(), needed);
  } else {
    why = "their amplitudes would be less certain than one row is";
  }
  return fmt::format("waves of {} per period are not told, and are taken for others where they are there: {}",
                     orders, why);
}

/// Waves, which are the first of the traits, that may be others that were left out.
void doubtWaves(std::span<const int> orders, Column distance_m, std::span<const double> frequency_hz,
                std::vector<Trait>& traits) {
  const std::span<const int> all{kOrders};
  auto doubts =
      doubtsOf(wavesOf(frequency_hz, orders), wavesOf(frequency_hz, all.subspan(orders.size())), distance_m);
  for (std::size_t w = 0; w < doubts.size(); ++w) {
    if (!doubts[w].empty()) traits[w].doubt = std::move(doubts[w]);
  }
}

/// Each amplitude's interval is shorter than the four standard deviations that one row's would have.
bool areToldApart(const std::vector<Trait>& traits) {
  const double sd = traits.back().value;  // "residual"
  constexpr auto kNoWaves = 3;            // offset, scale, residual
  return std::all_of(traits.begin(), traits.end() - kNoWaves,
                     [&](const Trait& one) { return one.high - one.low <= 4.0 * sd; });
}

}  // namespace

namespace {

/// Rows by themselves.
Result<FittedTraits> fitRows(Column distance_m, Column error_mm, const std::vector<Wave>& waves) {
  const auto rows = finiteRows({distance_m, error_mm}, 2 * waves.size() + 4, "harmonics");
  if (!rows) return rows.error();
  const auto &d = (*rows)[0], &e = (*rows)[1];
  const Model model = [&](std::span<const double> p, std::size_t i) { return seriesAt(p, waves, d[i]); };
  const auto fit = fitLeastSquares(model, e, std::vector<double>(2 + 2 * waves.size(), 0.0));
  if (!fit)
    return undetermined("harmonics", "the distances span too little of a period, or two orders coincide");
  return fittedOf(*fit, waves, d);
}

/// How far to the side of a wall each row is, u, and its capture's nearest row, d₀. What a camera errs by its
/// place in the image (a veil, the light's reach) would else be told as a slope over distance: within a
/// capture both go alike.
struct Sideways {
  std::vector<double> u{}, nearest_m{};
  static constexpr std::size_t kColumns = 4;

  Sideways(Column distance_m, std::span<const std::size_t> cluster) {
    std::map<std::size_t, double> nearest;
    for (std::size_t i = 0; i < distance_m.size(); ++i) {
      const double d = distance_m[i];
      if (const auto [at, is_new] = nearest.try_emplace(cluster[i], d); !is_new)
        at->second = std::fmin(at->second, d);
    }
    for (std::size_t i = 0; i < distance_m.size(); ++i) {
      nearest_m.push_back(nearest[cluster[i]]);
      u.push_back(distance_m[i] / nearest_m.back() - 1.0);
    }
  }
  /// Less tells no slope of its own.
  [[nodiscard]] bool isWide() const {
    return std::ranges::any_of(u, [](double one) { return one >= 0.05; });
  }
  [[nodiscard]] std::array<double, kColumns> at(std::size_t i) const {
    return {u[i], u[i] * u[i], nearest_m[i] * u[i], nearest_m[i] * u[i] * u[i]};
  }
};

/// How captures differ is not known of two of them, whatever many rows each has.
void doubtFewCaptures(std::size_t captures, std::vector<Trait>& traits) {
  if (captures >= 3) return;
  for (Trait& one : traits)
    one.doubt = fmt::format("it is from {} captures only, and it takes three", captures);
}

/// Rows in clusters that share an error.
Result<FittedTraits> fitClusters(Column distance_m, Column error_mm, const std::vector<Wave>& waves,
                                 std::span<const std::size_t> cluster) {
  std::vector<double> numbers(cluster.begin(), cluster.end());
  const auto rows = finiteRows({distance_m, error_mm, numbers}, 2 * waves.size() + 4, "harmonics");
  if (!rows) return rows.error();
  const auto& d = (*rows)[0];
  std::vector<std::vector<double>> columns{std::vector<double>(d.size(), 1.0), d};
  for (const Wave& wave : waves) {
    std::vector<double> even, odd;
    for (const double one : d)
      even.push_back(std::cos(wave.per_m * one)), odd.push_back(std::sin(wave.per_m * one));
    columns.push_back(std::move(even)), columns.push_back(std::move(odd));
  }
  const std::vector<std::size_t> captures((*rows)[2].begin(), (*rows)[2].end());
  const Sideways sideways{d, captures};
  const std::size_t first = columns.size();
  if (sideways.isWide()) {
    columns.resize(first + Sideways::kColumns, std::vector<double>(d.size()));
    for (std::size_t i = 0; i < d.size(); ++i) {
      for (std::size_t k = 0; k < Sideways::kColumns; ++k) columns[first + k][i] = sideways.at(i)[k];
    }
  }
  const auto fit = fitInClusters(columns, (*rows)[1], captures);
  if (!fit)
    return undetermined("harmonics", "the distances span too little of a period, or are of one capture only");
  FittedTraits fitted = fittedOf(*fit, waves, d);
  doubtFewCaptures(std::set<std::size_t>{captures.begin(), captures.end()}.size(), fitted.traits);
  if (!sideways.isWide()) return fitted;
  const Sideways of_all{distance_m, cluster};
  double variance = 0.0;  // of what goes sideways, over the rows
  for (std::size_t i = 0; i < distance_m.size(); ++i) {
    const auto at = of_all.at(i);
    fitted.besides.push_back(
        std::inner_product(at.begin(), at.end(), fit->at.begin() + static_cast<long>(first), 0.0));
    variance += fit->varianceOf(at, first) / static_cast<double>(distance_m.size());
  }
  // Two distances do not tell it from the slope: rows less a guess would show what nobody measured.
  if (!(variance <= fit->squares / static_cast<double>(fit->n))) fitted.besides.clear(), fitted.curve = {};
  return fitted;
}

Result<FittedTraits> fitOrders(Column distance_m, Column error_mm, std::span<const double> frequency_hz,
                               std::span<const int> orders, std::span<const std::size_t> cluster) {
  const std::vector<Wave> waves = wavesOf(frequency_hz, orders);
  if (waves.empty()) return undetermined("harmonics", "no frequency or order was given");
  return cluster.empty() ? fitRows(distance_m, error_mm, waves)
                         : fitClusters(distance_m, error_mm, waves, cluster);
}

/// The numbers alone.
Traits numbersOf(Result<FittedTraits> fitted) {
  if (!fitted) return fitted.error();
  return std::move(fitted->traits);
}

}  // namespace

Traits harmonicTraits(Column distance_m, Column error_mm, std::span<const double> frequency_hz,
                      std::span<const int> orders, std::span<const std::size_t> cluster) {
  return numbersOf(fitOrders(distance_m, error_mm, frequency_hz, orders, cluster));
}

Result<FittedTraits> fittedHarmonics(Column distance_m, Column error_mm, std::span<const double> frequency_hz,
                                     std::span<const std::size_t> cluster) {
  const std::size_t least = kRowsPerParameter * (2 + 2 * frequency_hz.size());
  const auto rows = finiteRows({distance_m, error_mm}, least, "harmonics");
  if (!rows) return rows.error();
  std::vector<int> orders;
  for (const int order : kOrders) {
    const std::size_t parameters = 2 + 2 * frequency_hz.size() * (orders.size() + 1);
    if (rows->front().size() >= kRowsPerParameter * parameters) orders.push_back(order);
  }
  for (; !orders.empty(); orders.pop_back()) {
    auto fitted = fitOrders(distance_m, error_mm, frequency_hz, orders, cluster);
    if (fitted) {
      fitted->not_told = ordersNotTold(orders.size(), rows->front(), frequency_hz);
      doubtWaves(orders, rows->front(), frequency_hz, fitted->traits);
    }
    if (orders.size() == 1 || (fitted && areToldApart(fitted->traits))) return fitted;
  }
  return undetermined("harmonics", "no frequency was given");
}

Traits harmonicTraits(Column distance_m, Column error_mm, std::span<const double> frequency_hz,
                      std::span<const std::size_t> cluster) {
  return numbersOf(fittedHarmonics(distance_m, error_mm, frequency_hz, cluster));
}

Traits wrapTraits(Column error_m, double period_m) {
  if (!(period_m > 0.0)) return undetermined("wraps", "the period must be a positive length");
  const auto rows = finiteRows({error_m}, 1, "wraps");
  if (!rows) return rows.error();
  const auto& errors = rows->front();
  const auto wrapped =
      std::ranges::count_if(errors, [&](double e) { return std::round(e / period_m) != 0.0; });
  return std::vector{shareTrait("wrapped", static_cast<std::size_t>(wrapped), errors.size())};
}

Traits wrapTraits(Column shares) {
  const auto rows = finiteRows({shares}, 2, "wraps");
  if (!rows) return rows.error();
  const Summary all = summarise(rows->front());
  const double n = static_cast<double>(all.n), p = all.mean;
  // Effective number of trials (E. L. Korn, B. I. Graubard, Surv. Methodol. 24 (1998) 193); where all parts are
  // alike, their scatter says nothing, and each of them is a trial.
  const double trials = all.sd > 0.0 ? p * (1.0 - p) * n / (all.sd * all.sd) : n;
  const auto interval = shareInterval(p * trials, trials, ShareRule::Jeffreys);
  return std::vector{Trait{"wrapped", "1", p, interval.low, interval.high, all.n}};
}

}  // namespace toftwin::compare
