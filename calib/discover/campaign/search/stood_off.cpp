// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/search/stood_off.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <toftwin/nan.h>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/least_squares.h"
#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/rows/carriers.h"

namespace toftwin::discover {
namespace {

constexpr double kTold = 0.5;       ///< Place::seen of a way that captures tell
constexpr std::size_t kFewest = 5;  ///< others, to say what is usual

/// Of each place how far it is from the middle one, in the way in which that is most: half of the places may be wrong.
std::vector<double> extremityOf(const std::vector<std::vector<double>>& ways) {
  std::vector<double> extremity(ways.front().size(), 0.0);
  for (const std::vector<double>& way : ways) {
    std::vector<double> told;
    for (const double one : way)
      if (std::isfinite(one)) told.push_back(one);
    if (told.size() <= kFewest) continue;
    const double middle = compare::quantile(told, 0.5);
    for (double& one : told) one = std::abs(one - middle);
    const double usual = std::max(compare::quantile(std::move(told), 0.5), 1e-12);
    for (std::size_t i = 0; i < way.size(); ++i)
      if (std::isfinite(way[i])) extremity[i] = std::max(extremity[i], std::abs(way[i] - middle) / usual);
  }
  return extremity;
}

/// What was set at these captures and at none but the `off` ones: an effect of it would be there alone, too.
std::string aloneAt(const std::vector<std::size_t>& captures, const std::vector<std::size_t>& off,
                    const std::vector<MeasuredCapture>& all) {
  const plan::CaptureRecord& here = all[captures.front()].record;
  std::vector<std::string> words;
  const auto add = [&](double plan::CaptureRecord::*setting, const char* unit) {
    constexpr double kAlike = 0.1;
    const double own = here.*setting;
    for (std::size_t c = 0; c < all.size(); ++c) {
      const double other = all[c].record.*setting;
      // NaN: nobody knows.
      const bool is_alike = !(std::abs(other - own) > kAlike * std::max(std::abs(other), std::abs(own)));
      if (is_alike && std::ranges::find(off, c) == off.end()) return;
    }
    words.push_back(fmt::format("{:.4g} {}", own, unit));
  };
  add(&plan::CaptureRecord::exposure_us, "µs"), add(&plan::CaptureRecord::ambient_klx, "klx");
  return fmt::format("{}", fmt::join(words, " and "));
}

}  // namespace

StoodOff describe(std::size_t stand, const std::vector<std::size_t>& stands, const std::vector<MeasuredCapture>& all,
                  const Place& place) {
  std::vector<std::size_t> captures;
  for (std::size_t c = 0; c < stands.size(); ++c)
    if (stands[c] == stand) captures.push_back(c);
  Stood off = place.off;
  for (std::size_t way = 0; way < off.size(); ++way)
    if (place.seen[way] < kTold) off[way] = 0.0;
  const plan::CaptureRecord& first = all[captures.front()].record;
  StoodOff stood{.name = first.name,
                 .number = first.number,
                 .shift_mm = kPosePrior_m * 1e3 * std::hypot(off[0], off[1], off[2]),
                 .turn_deg = kPosePrior_deg * std::hypot(off[3], off[4])};
  stood.captures = std::move(captures);
  return stood;
}

std::string StoodOff::inWords() const {
  const bool is_one = captures.size() == 1;
  return fmt::format("capture {} (\"{}\"){} stood {:.1f} mm and {:.2f}° from {} pose", number, name,
                     is_one ? "" : fmt::format(" and {} more from its place", captures.size() - 1), shift_mm, turn_deg,
                     is_one ? "its" : "their");
}

std::string noteOf(const StoodOff& off) {
  std::string note = fmt::format(
      "As its light says, {}, much farther than the others: the camera or the rig was bumped, or something acts there "
      "alone. ",
      off.inWords());
  if (off.is_set_aside)
    return note + "It is set aside: with it something was left, or found, that is not there without it.";
  note += "It was searched with the others";
  return note + (off.alone.empty() ? "." : fmt::format(", none of which was at {}: it may be no bump.", off.alone));
}

bool isFarOff(double deviation, const std::vector<double>& others, double wrong) {
  constexpr double kApart = 2.0;
  if (others.size() < kFewest) return false;
  const auto n = static_cast<double>(others.size());
  const double mean = std::accumulate(others.begin(), others.end(), 0.0) / n;
  double squares = 0.0, next = 0.0;
  for (const double one : others) {
    squares += (one - mean) * (one - mean);
    next = std::max(next, std::abs(one - mean));
  }
  const double off = std::abs(deviation - mean);
  const double t = off / std::sqrt(squares / (n - 1.0) * (1.0 + 1.0 / n));
  return t > compare::studentT(n - 1.0, 1.0 - wrong) && off > kApart * next;
}

std::vector<std::size_t> farOff(const std::vector<std::vector<double>>& ways, std::size_t most, double wrong) {
  if (ways.empty() || ways.front().empty()) return {};
  const std::size_t n = ways.front().size();
  const std::vector<double> extremity = extremityOf(ways);
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, std::greater<>{}, [&](std::size_t i) { return extremity[i]; });
  const double each = wrong / static_cast<double>(n * ways.size() * std::max<std::size_t>(1, most));
  for (std::size_t count = std::min(most, n); count > 0; --count) {
    std::vector<std::size_t> few(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count));
    std::vector<std::vector<double>> others(ways.size());
    for (std::size_t way = 0; way < ways.size(); ++way)
      for (std::size_t k = count; k < n; ++k)
        if (std::isfinite(ways[way][order[k]])) others[way].push_back(ways[way][order[k]]);
    const bool are_off = std::ranges::all_of(few, [&](std::size_t i) {
      for (std::size_t way = 0; way < ways.size(); ++way)
        if (std::isfinite(ways[way][i]) && isFarOff(ways[way][i], others[way], each)) return true;
      return false;
    });
    if (!are_off) continue;
    std::ranges::sort(few);
    return few;
  }
  return {};
}

std::vector<std::vector<double>> waysOf(const std::vector<Place>& places) {
  std::vector<std::vector<double>> ways(Stood{}.size());
  for (std::size_t way = 0; way < ways.size(); ++way)
    for (const Place& place : places) ways[way].push_back(place.seen[way] < kTold ? kNaN : place.off[way]);
  return ways;
}

Result<std::vector<StoodOff>> stoodOff(const Round& round, const OpenCaptures& open) {
  constexpr double kWrong = 1e-3;  // of setting aside one that was not
  const Lit lit{open.captures, round.traced, round.varied};
  const auto effects = withDelay(round.declared.model, round.refitted.effects, round.zero.delay_mm);
  const auto evidence = residualEvidence({round.declared, lit, round.finding.scales}, effects);
  if (!evidence) return evidence.error();
  const std::vector<Place> places = placesBy(*evidence, round.finding.scales);
  const auto ways = waysOf(places);
  const std::vector<std::size_t> stands = standsOf(open.captures);
  // Fewer places may have few enough captures.
  for (std::size_t most = std::max<std::size_t>(1, stands.size() / 20); most > 0; --most) {
    std::vector<StoodOff> off;
    std::vector<std::size_t> all;
    for (const std::size_t bumped : farOff(ways, most, kWrong)) {
      off.push_back(describe(bumped, stands, open.captures, places[bumped]));
      all.insert(all.end(), off.back().captures.begin(), off.back().captures.end());
    }
    if (all.size() > 1 && 20 * all.size() > stands.size()) continue;
    for (StoodOff& one : off) one.alone = aloneAt(one.captures, all, open.captures);
    return off;
  }
  return std::vector<StoodOff>{};
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
  SearchOf some{nullptr, nullptr, all.off};
  std::vector<std::size_t> gone;
  for (StoodOff& one : some.off) {
    one.is_set_aside = one.alone.empty();
    if (one.is_set_aside) gone.insert(gone.end(), one.captures.begin(), one.captures.end());
  }
  if (gone.empty() || (!leaves && all.round->things() == 0)) return all;
  some.without = without(gone, open);
  Declared otherwise = file;
  otherwise.delay_mm = 0.0;
  const auto late =
      delayThatFits({otherwise, {some.without->captures, some.without->at_poses, lightsOf(some.without->at_poses)}, {}});
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
