// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/stood_off.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/compare/traits/least_squares.h"
#include "calib/discover/campaign/carriers.h"
#include "calib/discover/campaign/places.h"

namespace toftwin::discover {
namespace {

constexpr double kTold = 0.5;  ///< Place::seen of a way that captures tell

/// The one that was bumped.
std::optional<std::size_t> bumpedOf(const std::vector<Place>& places) {
  constexpr double kWrong = 1e-3;  // of setting aside one that was not
  const std::size_t ways = Stood{}.size();
  for (std::size_t way = 0; way < ways; ++way) {
    std::vector<double> deviations;
    std::vector<std::size_t> of;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (places[i].seen[way] < kTold) continue;
      deviations.push_back(places[i].off[way]), of.push_back(i);
    }
    if (const auto one = oneFarOff(deviations, kWrong / static_cast<double>(ways))) return of[*one];
  }
  return std::nullopt;
}

/// What was set at these captures and at no others: an effect of it would be there alone, too.
std::string aloneAt(const std::vector<std::size_t>& captures, const std::vector<MeasuredCapture>& all) {
  const plan::CaptureRecord& here = all[captures.front()].record;
  std::vector<std::string> words;
  const auto add = [&](double plan::CaptureRecord::*setting, const char* unit) {
    constexpr double kAlike = 0.1;
    const double own = here.*setting;
    for (std::size_t c = 0; c < all.size(); ++c) {
      const double other = all[c].record.*setting;
      // NaN: nobody knows.
      const bool is_alike = !(std::abs(other - own) > kAlike * std::max(std::abs(other), std::abs(own)));
      if (is_alike && std::ranges::find(captures, c) == captures.end()) return;
    }
    words.push_back(fmt::format("{:.4g} {}", own, unit));
  };
  add(&plan::CaptureRecord::exposure_us, "µs"), add(&plan::CaptureRecord::ambient_klx, "klx");
  return fmt::format("{}", fmt::join(words, " and "));
}

StoodOff describe(std::vector<std::size_t> captures, const std::vector<MeasuredCapture>& all, const Place& place) {
  Stood off = place.off;
  for (std::size_t way = 0; way < off.size(); ++way)
    if (place.seen[way] < kTold) off[way] = 0.0;
  const plan::CaptureRecord& first = all[captures.front()].record;
  StoodOff stood{.name = first.name,
                 .number = first.number,
                 .shift_mm = kPosePrior_m * 1e3 * std::hypot(off[0], off[1], off[2]),
                 .turn_deg = kPosePrior_deg * std::hypot(off[3], off[4]),
                 .alone = aloneAt(captures, all)};
  stood.captures = std::move(captures);
  return stood;
}

}  // namespace

std::string StoodOff::inWords() const {
  const bool is_one = captures.size() == 1;
  return fmt::format("capture {} (\"{}\"){} stood {:.1f} mm and {:.2f}° from {} pose", number, name,
                     is_one ? "" : fmt::format(" and {} more from its place", captures.size() - 1), shift_mm, turn_deg,
                     is_one ? "its" : "their");
}

std::string noteOf(const StoodOff& off) {
  std::string note = fmt::format(
      "As its light says, {}, much farther than any other: the camera or the rig was bumped, or something acts there "
      "alone. ",
      off.inWords());
  if (off.is_set_aside)
    return note + "It is set aside: with it something was left, or found, that is not there without it.";
  note += "It was searched with the others";
  return note + (off.alone.empty() ? "." : fmt::format(", none of which was at {}: it may be no bump.", off.alone));
}

std::optional<std::size_t> oneFarOff(const std::vector<double>& deviations, double wrong) {
  constexpr std::size_t kFewest = 6;
  constexpr double kApart = 2.0;
  const std::size_t n = deviations.size();
  if (n < kFewest) return std::nullopt;
  const auto others = static_cast<double>(n - 1);
  const double sum = std::accumulate(deviations.begin(), deviations.end(), 0.0);
  const auto offMean = [&](std::size_t i) { return std::abs(deviations[i] - (sum - deviations[i]) / others); };
  std::size_t farthest = 0;
  for (std::size_t i = 1; i < n; ++i)
    if (offMean(i) > offMean(farthest)) farthest = i;
  const double mean = (sum - deviations[farthest]) / others;
  double squares = 0.0, next = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    if (i == farthest) continue;
    squares += (deviations[i] - mean) * (deviations[i] - mean);
    next = std::max(next, std::abs(deviations[i] - mean));
  }
  const double off = std::abs(deviations[farthest] - mean);
  const double t = off / std::sqrt(squares / (others - 1.0) * (1.0 + 1.0 / others));
  const double chance = compare::studentT(others - 1.0, 1.0 - wrong / static_cast<double>(n));
  return t > chance && off > kApart * next ? std::optional{farthest} : std::nullopt;
}

Result<std::optional<StoodOff>> stoodOff(const Round& round, const OpenCaptures& open) {
  const Lit lit{open.captures, round.traced, open.at_poses};
  const auto effects = withDelay(round.declared.model, round.refitted.effects, round.zero.delay_mm);
  const auto evidence = residualEvidence({round.declared, lit, round.finding.scales}, effects);
  if (!evidence) return evidence.error();
  const std::vector<Place> places = placesBy(*evidence, round.finding.scales);
  const auto bumped = bumpedOf(places);
  if (!bumped) return std::optional<StoodOff>{};
  const std::vector<std::size_t> stands = standsOf(open.captures);
  std::vector<std::size_t> captures;
  for (std::size_t c = 0; c < stands.size(); ++c)
    if (stands[c] == *bumped) captures.push_back(c);
  if (captures.size() > 1 && 20 * captures.size() > stands.size()) return std::optional<StoodOff>{};
  return std::optional{describe(std::move(captures), open.captures, places[*bumped])};
}

namespace {

std::unique_ptr<SomeCaptures> without(const std::vector<std::size_t>& gone, const OpenCaptures& open) {
  auto some = std::make_unique<SomeCaptures>();
  for (std::size_t c = 0; c < open.captures.size(); ++c) {
    if (std::ranges::find(gone, c) != gone.end()) continue;
    some->captures.push_back(open.captures[c]), some->at_poses.push_back(open.at_poses[c]);
  }
  return some;
}

}  // namespace

Result<SearchOf> searchBesideBumped(const Declared& file, const OpenCaptures& open,
                                    const std::function<void()>& begin, const std::function<void(double)>& tell) {
  auto round = searchInRounds(file, open, begin, tell);
  if (!round) return round.error();
  SearchOf all{nullptr, *std::move(round), {}};
  auto off = stoodOff(*all.round, open);
  if (!off) return off.error();
  all.off = *std::move(off);
  const double alpha = open.finder.alpha;
  const bool leaves = all.round->leavesSomething(alpha);
  if (!all.off || !all.off->alone.empty() || (!leaves && all.round->things() == 0)) return all;
  SearchOf some{without(all.off->captures, open), nullptr, all.off};
  some.off->is_set_aside = true;
  Declared otherwise = file;
  otherwise.delay_mm = 0.0;
  const auto late =
      delayThatFits({otherwise, {some.without->captures, some.without->at_poses, some.without->at_poses}, {}});
  if (!late) return late.error();
  otherwise.delay_mm = *late;
  const OpenCaptures others{some.without->captures, some.without->at_poses, open.trace,        open.finder,
                            open.left_out,          open.has_steps,         open.trusts_poses};
  auto again = searchInRounds(otherwise, others, [] {}, {});
  if (!again) return again.error();
  some.round = *std::move(again);
  const bool counts =
      !some.round->leavesSomething(alpha) && (leaves || some.round->things() < all.round->things());
  return counts ? std::move(some) : std::move(all);
}

}  // namespace toftwin::discover
