// SPDX-License-Identifier: Apache-2.0
// What goes with distance: which harmonics rows tell, and which of them may be others.
#include <fmt/format.h>
#include <toftwin/units.h>

#include <algorithm>
#include <array>
#include <numbers>

#include "calib/compare/traits/harmonic_fit.h"
#include "calib/compare/traits/least_squares.h"
#include "calib/compare/traits/repeats.h"
#include "calib/compare/traits/waves.h"

namespace toftwin::compare {
namespace {

/// Fewer rows for each parameter of a fit tell little more than themselves.
constexpr std::size_t kRowsPerParameter = 3;

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

/// "offset" and "scale" of a fit that leaves waves out, as these may be in them: in doubt where one as large as the
/// largest of those that are clearly there would change them by over half of theirs.
void doubtLine(std::span<const int> orders, Column distance_m, std::span<const double> frequency_hz,
               std::vector<Trait>& traits) {
  const std::span<const int> all{kOrders};
  const auto waves = wavesOf(frequency_hz, orders);
  const auto shown = shownInLine(waves, wavesOf(frequency_hz, all.subspan(orders.size())), distance_m);
  constexpr double kOfInterval = 0.9;  // 3.5 standard errors: 0.2 % of waves that are not there seem so large
  double largest_mm = 0.0;
  for (std::size_t w = 0; w < waves.size(); ++w) {
    if (traits[w].value > kOfInterval * (traits[w].high - traits[w].low))
      largest_mm = std::max(largest_mm, traits[w].value);
  }
  const auto doubt = [&](Trait& one, const ShownInLine& line) {
    if (!(line.most * largest_mm > 0.5 * (one.high - one.low)) || !one.doubt.empty()) return;
    one.doubt = fmt::format(
        "a wave of {} is not told, and one of {:.2g} mm, as another is, would change it by {:.2g} {}",
        line.wave, largest_mm, line.most * largest_mm, one.unit);
  };
  doubt(traits[waves.size()], shown.offset), doubt(traits[waves.size() + 1], shown.scale);
}

/// Waves, which are the first of the traits, of which less than half a period is seen: they are in the fit, so
/// that they are in the intervals of the others, but what a bend of the rows is of nobody can say.
std::string leaveOutLongWaves(std::span<const int> orders, Column distance_m,
                              std::span<const double> frequency_hz, std::vector<Trait>& traits) {
  const auto [nearest, farthest] = std::ranges::minmax(distance_m);
  const std::vector<Wave> waves = wavesOf(frequency_hz, orders);
  std::string names;
  for (std::size_t w = waves.size(); w-- > 0;) {
    if ((farthest - nearest) * waves[w].per_m >= std::numbers::pi) continue;
    names = waves[w].name + (names.empty() ? "" : "; ") + names;
    traits.erase(traits.begin() + static_cast<std::ptrdiff_t>(w));
  }
  if (names.empty()) return {};
  return fmt::format("less than half of a period is seen, over {:.3g} m of distance, of waves of {}: they are not told",
                     farthest - nearest, names);
}

/// Each amplitude's interval is shorter than the four standard deviations that one row's would have, if it scattered
/// by `sd_mm`.
bool areToldApart(const std::vector<Trait>& traits, double sd_mm) {
  constexpr auto kNoWaves = 3;  // offset, scale, residual
  return std::all_of(traits.begin(), traits.end() - kNoWaves,
                     [&](const Trait& one) { return one.high - one.low <= 4.0 * sd_mm; });
}
bool areToldApart(const std::vector<Trait>& traits) { return areToldApart(traits, traits.back().value); }

/// Whether rows speak for waves that a smaller fit leaves out, and tell them better than what that leaves: they
/// would be in its other numbers. "Very strong" evidence (R. E. Kass, A. E. Raftery, J. Am. Stat. Assoc. 90
/// (1995) 773).
bool areMissed(const FittedTraits& larger, const FittedTraits& smaller) {
  constexpr double kVeryStrong = 10.0;
  return smaller.bic - larger.bic > kVeryStrong &&
         areToldApart(larger.traits, smaller.traits.back().value);
}

/// All waves together are told where one of them may be another, and nothing else is wrong with them.
void keepTogetherWhereDoubted(FittedTraits& fitted, bool were_sure) {
  const auto isDoubted = [](const Trait& one) { return !one.doubt.empty(); };
  if (!were_sure || std::ranges::none_of(fitted.traits, isDoubted)) fitted.together.reset();
}

/// How many orders so many rows allow for: as many distances as twice the parameters, where rows share them.
std::vector<int> ordersFor(const std::vector<double>& distance_m, std::size_t frequencies, bool are_clusters) {
  constexpr std::size_t kPlacesPerParameter = 2;
  const SharedPlaces places = sharedPlacesOf(distance_m);
  const bool are_shared = !are_clusters && places.areShared();
  std::vector<int> orders;
  for (const int order : kOrders) {
    const std::size_t parameters = 2 + 2 * frequencies * (orders.size() + 1);
    if (distance_m.size() < kRowsPerParameter * parameters) break;
    if (are_shared && !orders.empty() && places.count < kPlacesPerParameter * parameters) break;
    orders.push_back(order);
  }
  return orders;
}

/// The numbers alone.
Traits numbersOf(Result<FittedTraits> fitted) {
  if (!fitted) return fitted.error();
  return std::move(fitted->traits);
}

}  // namespace

Traits harmonicTraits(Column distance_m, Column error_mm, std::span<const double> frequency_hz,
                      std::span<const int> orders, const RowClusters& clusters) {
  return numbersOf(fitHarmonics(distance_m, error_mm, frequency_hz, orders, clusters));
}

Result<FittedTraits> fittedHarmonics(Column distance_m, Column error_mm, std::span<const double> frequency_hz,
                                     const RowClusters& clusters, std::size_t least_orders) {
  const std::size_t least = kRowsPerParameter * (2 + 2 * frequency_hz.size());
  const auto rows = finiteRows({distance_m, error_mm}, least, "harmonics");
  if (!rows) return rows.error();
  std::vector<int> orders = ordersFor(rows->front(), frequency_hz.size(), !clusters.of.empty());
  std::optional<FittedTraits> larger;
  for (; !orders.empty(); orders.pop_back()) {
    auto fitted = fitHarmonics(distance_m, error_mm, frequency_hz, orders, clusters);
    if (!fitted) {
      if (orders.size() == 1) return larger ? std::move(*larger) : fitted;
      continue;
    }
    if (larger && areMissed(*larger, *fitted)) return std::move(*larger);
    fitted->orders = orders.size();
    fitted->not_told = ordersNotTold(orders.size(), rows->front(), frequency_hz);
    const bool are_sure = fitted->traits.front().doubt.empty();
    doubtWaves(orders, rows->front(), frequency_hz, fitted->traits);
    doubtLine(orders, rows->front(), frequency_hz, fitted->traits);
    const bool is_chosen = orders.size() == 1 || orders.size() <= least_orders || areToldApart(fitted->traits);
    const std::string too_long = leaveOutLongWaves(orders, rows->front(), frequency_hz, fitted->traits);
    if (!too_long.empty()) fitted->not_told += (fitted->not_told.empty() ? "" : "; ") + too_long;
    keepTogetherWhereDoubted(*fitted, are_sure);
    if (is_chosen) return fitted;
    larger = std::move(*fitted);
  }
  return undetermined("harmonics", "no frequency was given");
}

Traits harmonicTraits(Column distance_m, Column error_mm, std::span<const double> frequency_hz,
                      const RowClusters& clusters) {
  return numbersOf(fittedHarmonics(distance_m, error_mm, frequency_hz, clusters));
}

std::array<Result<FittedTraits>, 2> withTheSameWaves(const std::array<HarmonicFit, 2>& fits) {
  std::array both{fits[0](0), fits[1](0)};
  if (!both[0] || !both[1] || both[0]->orders == both[1]->orders) return both;
  const std::size_t fewer = both[0]->orders < both[1]->orders ? 0 : 1;
  constexpr double kMost = 2.0;  // of what tells waves apart; over part of a period they would be anything
  auto more = fits[fewer](both[1 - fewer]->orders);
  if (more && areToldApart(more->traits, kMost * more->traits.back().value)) both[fewer] = std::move(more);
  return both;
}

}  // namespace toftwin::compare
