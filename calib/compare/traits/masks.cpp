// SPDX-License-Identifier: Apache-2.0
// Which pixels are valid in both cameras, and when frames come.
#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <limits>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/bursts.h"
#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {

Traits maskTraits(std::span<const Image<std::uint8_t>> a, std::span<const Image<std::uint8_t>> b) {
  if (a.size() != b.size() || a.size() < 2)
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("mask agreement: {} masks of A and {} of B; it takes two pairs", a.size(), b.size())};
  std::vector<double> agreement, overlap, kappa;
  for (std::size_t pair = 0; pair < a.size(); ++pair) {
    if (a[pair].size() != b[pair].size() || a[pair].empty())
      return Error{Error::Code::InvalidArgument,
                   fmt::format("mask agreement: pair {} is of different sizes", pair + 1)};
    double both = 0.0, only_a = 0.0, only_b = 0.0;
    const double n = static_cast<double>(a[pair].size());
    for (std::size_t i = 0; i < a[pair].size(); ++i) {
      const bool in_a = a[pair][i] != 0, in_b = b[pair][i] != 0;
      both += in_a && in_b ? 1.0 : 0.0;
      only_a += in_a && !in_b ? 1.0 : 0.0;
      only_b += in_b && !in_a ? 1.0 : 0.0;
    }
    const double agree = 1.0 - (only_a + only_b) / n, share_a = (both + only_a) / n,
                 share_b = (both + only_b) / n;
    // What two masks of these sizes agree by chance (J. Cohen, Educ. Psychol. Meas. 20 (1960) 37).
    const double chance = share_a * share_b + (1.0 - share_a) * (1.0 - share_b);
    agreement.push_back(agree);
    overlap.push_back(both + only_a + only_b > 0.0 ? both / (both + only_a + only_b) : 1.0);
    if (chance < 1.0) kappa.push_back((agree - chance) / (1.0 - chance));
  }
  std::vector<Trait> traits{meanTrait("agreement", "1", agreement), meanTrait("overlap", "1", overlap)};
  if (kappa.size() > 1) traits.push_back(meanTrait("kappa", "1", kappa));
  // Pairs that all agree alike do not say how they scatter: as many trials, none of which failed (or held).
  for (Trait& one : traits) {
    if (one.low < one.high || (one.value > 0.0 && one.value < 1.0)) continue;
    const double n = static_cast<double>(one.n);
    const auto interval = shareInterval(one.value * n, n, ShareRule::ClopperPearson);
    one.low = interval.low, one.high = interval.high;
  }
  return traits;
}

namespace {

/// Σ alone / Σ of, a ratio of two means: by how its rows scatter about it (W. G. Cochran, Sampling
/// Techniques, ch. 6), so that captures that show more or less of all pixels widen nothing.
Trait lackTrait(const char* name, const std::vector<double>& alone, const std::vector<double>& of,
                double least) {
  const double mean = summarise(of).mean, share = summarise(alone).mean / mean;
  std::vector<double> left;
  for (std::size_t i = 0; i < of.size(); ++i) left.push_back(alone[i] - share * of[i]);
  Trait lack = meanTrait(name, "1", left, 1.0 / mean);
  const double half = std::max(0.5 * (lack.high - lack.low), least / mean);
  lack.value = share;
  lack.low = std::clamp(share - half, 0.0, 1.0), lack.high = std::clamp(share + half, 0.0, 1.0);
  return lack;
}

}  // namespace

Result<ValidTraits> validTraits(Column valid_a, Column valid_b, Column valid_both, double pixels) {
  const auto rows = finiteRows({valid_a, valid_b, valid_both}, 1, "valid pixels");
  if (!rows) return rows.error();
  const auto &a = (*rows)[0], &b = (*rows)[1], &both = (*rows)[2];
  std::vector<double> less, only_a, only_b;
  for (std::size_t i = 0; i < a.size(); ++i)
    less.push_back(b[i] - a[i]), only_a.push_back(a[i] - both[i]), only_b.push_back(b[i] - both[i]);
  Trait difference = meanTrait("share", "1", less);
  const double least = 0.5 / std::max(1.0, pixels);
  difference.low = std::min(difference.low, difference.value - least);
  difference.high = std::max(difference.high, difference.value + least);
  return ValidTraits{
      .a = {meanTrait("share", "1", a)},
      .b = {meanTrait("share", "1", b)},
      .difference = {difference},
      .both = {meanTrait("of A alone", "1", only_a), meanTrait("of B alone", "1", only_b),
               lackTrait(kLackedByB, only_a, a, least), lackTrait(kLackedByA, only_b, b, least)}};
}

/// Frames say their starts in nanoseconds; seconds since long ago are coarser than that in 53 bits.
constexpr double kTick_s = 1e-9;

Traits timingTraits(std::span<const std::vector<double>> starts_s) {
  std::vector<std::vector<double>> series_of_intervals;
  std::vector<double> intervals;
  double latest_s = 0.0;
  for (const auto& series : starts_s) {
    const auto rows = finiteRows({series}, 1, "frame timing");
    if (!rows) continue;
    const auto& starts = rows->front();
    auto& of_series = series_of_intervals.emplace_back();
    for (std::size_t i = 1; i < starts.size(); ++i) of_series.push_back(starts[i] - starts[i - 1]);
    intervals.insert(intervals.end(), of_series.begin(), of_series.end());
    latest_s = std::max(latest_s, std::abs(starts.back()));
  }
  if (intervals.size() < 3) return undetermined("frame timing", "fewer than four frames say when they began");
  if (std::ranges::min(intervals) <= 0.0)
    return undetermined("frame timing", "frames must start one after the other");
  const double usual = quantile(intervals, 0.5);
  std::vector<double> whole;
  Trials frames;  // that happen to be lost
  for (const auto& of_series : series_of_intervals) {
    frames.add(false);
    for (const double one : of_series) {
      const double periods = std::max(1.0, std::round(one / usual));
      if (periods == 1.0) whole.push_back(one);
      frames.add(true, static_cast<std::size_t>(periods) - 1);
      frames.add(false);
    }
    frames.endSeries();
  }
  if (whole.size() < 2) return undetermined("frame timing", "hardly two frames follow each other without a gap");
  const Summary summary = summarise(whole);
  const double degrees = static_cast<double>(summary.n - 1);
  const boost::math::chi_squared spread{std::max(1.0, degrees)};
  Trait jitter{
      .name = "jitter", .unit = "ms", .value = 1e3 * summary.sd, .low = 0.0, .high = 0.0, .n = summary.n};
  jitter.low = jitter.value * std::sqrt(degrees / boost::math::quantile(spread, 0.975));
  jitter.high = jitter.value * std::sqrt(degrees / boost::math::quantile(spread, 0.025));
  // What is shorter than a tick is rounding, and no other rounding differs from it.
  const double tick_ms = 1e3 * (kTick_s + latest_s * std::numeric_limits<double>::epsilon());
  if (jitter.value < tick_ms)
    jitter.value = jitter.low = 0.0, jitter.high = std::max(jitter.high, tick_ms);
  Trait interval = meanTrait("interval", "ms", whole, 1e3);
  interval.low = std::min(interval.low, interval.value - tick_ms);
  interval.high = std::max(interval.high, interval.value + tick_ms);
  return std::vector{interval, jitter, frames.share("lost")};
}

Traits timingTraits(Column start_s) {
  const std::vector<std::vector<double>> one{{start_s.begin(), start_s.end()}};
  return timingTraits(one);
}

}  // namespace toftwin::compare
