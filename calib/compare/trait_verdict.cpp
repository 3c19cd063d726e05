// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/trait_verdict.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <variant>

#include <fmt/format.h>

#include <toftwin/nan.h>

#include "calib/compare/traits/common_reference.h"
#include "calib/compare/traits/difference.h"

namespace toftwin::compare {
namespace {

/// What is left of a fit is of B − A, but no difference of two numbers.
bool isDifference(const NamedTrait& one) { return one.of == "B − A" && one.trait.name != "residual"; }

/// Almost any systematic error that is uneven over the image (a veil, waves, a tilt) shows as a pattern, too.
bool isPattern(const TraitVerdict& one) {
  return one.what.starts_with("fixed pattern") || one.difference.name == "fixed pattern";
}

/// A camera's numbers, or those of B − A, by what they are and their name.
class Owned {
 public:
  Owned(const NamedTraits& traits, std::string_view of) {
    for (const NamedTrait& one : traits.traits) {
      if (one.of == of) all_[{one.what, one.trait.name}] = &one;
    }
  }
  [[nodiscard]] const NamedTrait* find(const NamedTrait& like) const {
    return find(like.what, like.trait.name);
  }
  [[nodiscard]] const NamedTrait* find(const std::string& what, const std::string& name) const {
    const auto found = all_.find({what, name});
    return found == all_.end() ? nullptr : found->second;
  }

 private:
  std::map<std::pair<std::string, std::string>, const NamedTrait*> all_;
};

/// Why a number may be another's, and whose it is.
std::string doubtOf(const TraitVerdict& one) {
  if (!one.difference.doubt.empty()) return one.difference.doubt;
  if (one.is_paired) return "";
  if (one.a && !one.a->trait.doubt.empty()) return "of A, " + one.a->trait.doubt;
  return one.b && !one.b->trait.doubt.empty() ? "of B, " + one.b->trait.doubt : "";
}

/// What a camera that nobody measured there would show.
bool isExtrapolated(const TraitVerdict& one) {
  return one.difference.is_extrapolated || (one.a && one.a->trait.is_extrapolated) ||
         (one.b && one.b->trait.is_extrapolated);
}

/// Why the difference of one part of a noise law says nothing: where it does not show of one camera, its others
/// have taken it up.
std::string standInOf(const TraitVerdict& one) {
  const auto isIt = [&](const char* part) { return one.difference.name == part; };
  if (!one.a || !one.b || (std::ranges::none_of(kLawParts, isIt) && std::ranges::none_of(kPatternParts, isIt)))
    return "";
  const bool is_no_a = one.a->trait.value == 0.0, is_no_b = one.b->trait.value == 0.0;
  if (is_no_a == is_no_b) return "";
  return fmt::format("{}'s rows do not show it, and parts of the law stand in for one another; \"{}\" is told",
                     is_no_a ? "A" : "B", kWholeLaw);
}

/// A difference that shows by Student's interval of two rows is one; that none shows says nothing.
constexpr std::size_t kFewestRows = 3;

void holdTogether(TraitVerdict& one, double wider) {
  const std::string doubt = isExtrapolated(one) ? "it is told far from all rows" : doubtOf(one);
  if (!one.b || one.is_paired) {
    if (const auto* line = std::get_if<OnLine>(&one.difference.refers_to))
      one.at = placeInWords(line->at_m), one.line = *line;
    one.difference = widened(one.difference, wider);
  } else {
    const Trait &a = one.a->trait, &b = one.b->trait;
    HeldTogether held = heldTogether(a, b, wider);
    one.is_size = held.is_size, one.at = std::move(held.at), one.why_not = std::move(held.why_not);
    one.line = held.line;
    one.difference = std::move(held.difference);
    if (!one.why_not.empty()) one.difference = {b.name, b.unit, kNaN, kNaN, kNaN, std::min(a.n, b.n)};
  }
  if (one.line) {
    one.on_line_mm = one.difference.value;
    one.is_of_scale = goesThroughNothing(one.on_line_mm, *one.line, wider);
  }
  if (one.why_not.empty()) one.why_not = doubt;
  if (one.why_not.empty()) one.why_not = standInOf(one);
  if (one.why_not.empty() && !one.differs() && one.difference.n < kFewestRows) {
    one.why_not =
        fmt::format("it is from {} only, and it takes {} to call it the same",
                    one.difference.n == 1 ? "one" : fmt::format("{}", one.difference.n), kFewestRows);
  }
}

/// Shares of the other's pixels that each lacks; they hold together with all verdicts.
void addLacks(const Owned& of_pair, double wider, TraitVerdict& one) {
  const auto lackedBy = [&](const char* name) {
    const NamedTrait* found = of_pair.find(one.what, name);
    if (found == nullptr) return Trait{};
    Trait lacked = widened(found->trait, wider);
    lacked.low = std::max(0.0, lacked.low), lacked.high = std::min(1.0, lacked.high);
    return lacked;
  };
  one.lacked_by_b = lackedBy(kLackedByB), one.lacked_by_a = lackedBy(kLackedByA);
}

/// Why a camera has no such number, as far as it was said when it was looked for; rather of this number than
/// of another of its kind.
std::string whyNone(const NamedTraits& traits, const NamedTrait& like, std::string_view other) {
  const std::string of = fmt::format("{} of {}: ", like.what, other);
  for (const std::string& begin : {fmt::format("{}{}: ", of, like.trait.name), of}) {
    for (const std::string& said : traits.untold) {
      if (said.starts_with(begin)) return ": " + said.substr(of.size());
    }
  }
  for (const NamedTrait& one : traits.traits) {
    if (one.of == other && one.what == like.what && !one.detail.empty())
      return ": its is told as " + one.detail;
  }
  return "";
}

/// An offset that a scale makes of which it is told that it differs: that of its own line, or of the other one where
/// waves over distance are told of B − A and of both cameras.
bool isScales(const TraitVerdict& one, const std::vector<TraitVerdict>& all) {
  return one.isOffset() && one.is_of_scale &&
         std::ranges::any_of(all, [](const TraitVerdict& other) { return other.isScale() && other.differs(); });
}

/// Where along the distances a scale is how much is known by its offset's line.
void addLines(std::vector<TraitVerdict>& all) {
  for (TraitVerdict& one : all) {
    if (!one.isScale()) continue;
    const auto isBeside = [&](const TraitVerdict& other) { return other.isOffset() && other.what == one.what; };
    const auto offset = std::ranges::find_if(all, isBeside);
    if (offset == all.end() || !offset->line) continue;
    offset->has_scale = one.differs();
    one.line = offset->line, one.on_line_mm = offset->on_line_mm, one.is_of_scale = offset->is_of_scale;
  }
}

/// Those that are not told come last; of those that differ, what others make comes behind them. Where a floor is
/// 0, what differs is infinitely far beyond it.
std::pair<int, double> rankOf(const TraitVerdict& one, bool is_of_others) {
  enum { kHidden, kDiffers, kOfOthers, kMissing, kSame, kNotTold };
  if (!one.isTold()) return {kNotTold, 0.0};
  if (!one.differs()) return {one.isMissing() ? kMissing : kSame, 0.0};
  if (one.isWraps() || (one.isMissing() && !one.isMissingAlike())) return {kHidden, 0.0};
  return {is_of_others ? kOfOthers : kDiffers, -one.timesFloor()};
}

void sort(std::vector<TraitVerdict>& all) {
  std::vector<std::pair<std::pair<int, double>, std::size_t>> order;
  for (const TraitVerdict& one : all)
    order.push_back({rankOf(one, isPattern(one) || isScales(one, all)), order.size()});
  std::ranges::sort(order);
  std::vector<TraitVerdict> sorted;
  for (const auto& place : order) sorted.push_back(std::move(all[place.second]));
  all = std::move(sorted);
}

/// A row for each number that one camera has alone; one for all of a kind of which the other has none.
/// Nothing where there is no other.
void addAlone(const NamedTraits& traits, const Owned& of_other, std::string_view of, std::string_view other,
              std::vector<TraitVerdict>& all) {
  std::set<std::string> kinds;
  if (std::ranges::none_of(traits.traits, [&](const NamedTrait& its) { return its.of == other; })) return;
  for (const NamedTrait& one : traits.traits) {
    if (one.of != of || of_other.find(one) != nullptr) continue;
    const auto isOthers = [&](const NamedTrait& its) { return its.of == other && its.what == one.what; };
    const bool has_kind = std::ranges::any_of(traits.traits, isOthers);
    if (!has_kind && !kinds.insert(one.what).second) continue;
    TraitVerdict row{.what = one.what,
                     .difference = {has_kind ? one.trait.name : one.what, one.trait.unit, kNaN, kNaN, kNaN},
                     .why_not = fmt::format("{} has none{}", other, whyNone(traits, one, other))};
    if (!has_kind) row.difference.unit.clear();
    if (has_kind) (of == "A" ? row.a : row.b) = one;
    all.push_back(std::move(row));
  }
}

}  // namespace

bool TraitVerdict::isTold() const {
  if (!why_not.empty()) return false;
  const auto known = [&](double end) { return isKnown(end, difference.unit); };
  return known(difference.value) && known(difference.low) && known(difference.high);
}

double TraitVerdict::floor() const {
  return difference.value < 0.0 ? difference.high - difference.value : difference.value - difference.low;
}

double TraitVerdict::timesFloor() const { return std::abs(difference.value) / floor(); }

bool TraitVerdict::isWraps() const {
  return what == "wraps" && isTold() && differs() && std::abs(difference.value) > 0.01;
}

bool TraitVerdict::isOffset() const { return difference.name == "offset"; }

bool TraitVerdict::isScale() const { return difference.name == "scale"; }

double TraitVerdict::offAt(double distance_m) const { return on_line_mm + line->slope * (distance_m - line->at_m); }

bool isLack(const Trait& lacked) { return lacked.value > 0.05 && lacked.low > 0.0; }

bool TraitVerdict::isMissing() const { return isLack(lacked_by_b) || isLack(lacked_by_a); }

bool TraitVerdict::isMissingAlike() const {
  constexpr double kMoreThanOther = 2.0;  // as of a single condition
  if (!isMissing() || !a || !b) return false;
  const double by_a = lacked_by_a.value, by_b = lacked_by_b.value;
  // Where each has a pixel by chance, B lacks of A's what it lacks of all.
  const bool is_chance = by_b <= 1.0 - b->trait.value && by_a <= 1.0 - a->trait.value;
  return is_chance && by_a <= kMoreThanOther * by_b && by_b <= kMoreThanOther * by_a;
}

std::vector<TraitVerdict> verdictsOf(const NamedTraits& traits) {
  const Owned of_a{traits, "A"}, of_b{traits, "B"}, of_both{traits, "B − A"}, of_pair{traits, "A and B"};
  std::vector<TraitVerdict> all;
  for (const NamedTrait& one : traits.traits) {
    const NamedTrait *a = of_a.find(one), *b = of_b.find(one);
    const bool has_both = a != nullptr && b != nullptr;
    if (isDifference(one) && has_both)
      all.push_back({.what = one.what, .a = *a, .b = *b, .difference = one.trait, .is_paired = true});
    else if (isDifference(one))
      all.push_back({.what = one.what, .difference = one.trait});
    else if (one.of == "B" && has_both && of_both.find(one) == nullptr)
      all.push_back({.what = one.what, .a = *a, .b = one});
  }
  const auto beyond = static_cast<std::size_t>(std::ranges::count_if(all, isExtrapolated));
  const double wider = widenedFor(all.size() - beyond);
  for (TraitVerdict& one : all) {
    holdTogether(one, wider);
    if (one.what == kValidPixels) addLacks(of_pair, wider, one);
  }
  addLines(all);
  addAlone(traits, of_b, "A", "B", all), addAlone(traits, of_a, "B", "A", all);
  sort(all);
  return all;
}

Json toJson(const std::vector<TraitVerdict>& all) {
  Json rows = Json::array();
  for (const TraitVerdict& one : all) {
    Json row = Json::object();
    row.set("characteristic", one.what).set("name", one.difference.name).set("unit", one.difference.unit);
    row.set("difference", one.difference.value)
        .set("low", one.difference.low)
        .set("high", one.difference.high);
    row.set("floor", one.floor())
        .set("verdict", !one.isTold()   ? "not told"
                        : one.differs() ? "differs"
                                        : "same")
        .set("why_not", one.why_not);
    if (!one.at.empty()) row.set("at", one.at);
    if (one.line) {
      row.set("nearest_m", one.line->from_m).set("at_nearest_mm", one.offAt(one.line->from_m));
      row.set("farthest_m", one.line->to_m).set("at_farthest_mm", one.offAt(one.line->to_m));
    }
    rows.push(std::move(row));
  }
  return rows;
}

}  // namespace toftwin::compare
