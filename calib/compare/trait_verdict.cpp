// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/trait_verdict.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <fmt/format.h>

#include <toftwin/nan.h>

#include "calib/compare/traits/common_reference.h"
#include "calib/compare/traits/difference.h"

namespace toftwin::compare {
namespace {

constexpr std::size_t kShownFirst = 3;  ///< differences that have a card

/// What is left of a fit, and an intercept far from all rows, are of B − A but no difference of two numbers.
bool isDifference(const NamedTrait& one) {
  return one.of == "B − A" && one.trait.name != "residual" && one.trait.name != "at 1";
}

std::string number(double value) {
  const std::string text = fmt::format("{:.3g}", value);
  return text.starts_with('-') ? "−" + text.substr(1) : text;
}

std::string unitOf(const TraitVerdict& one) {
  return one.difference.unit.empty() || one.difference.unit == "1" ? "" : " " + one.difference.unit;
}

std::string nameOf(const TraitVerdict& one) {
  return one.what == one.difference.name ? one.what : one.what + ": " + one.difference.name;
}

bool isWaves(const TraitVerdict& one) { return one.what.starts_with("harmonics"); }

/// Wrapped readings of the wall, a share that differs by over 1 %.
bool isWraps(const TraitVerdict& one) {
  return one.what == "wraps" && one.isTold() && one.differs() && std::abs(one.difference.value) > 0.01;
}

/// The amplitude of a wave of B − A: how large it is.
bool isSize(const TraitVerdict& one) {
  return one.is_size || (isWaves(one) && !one.b && one.difference.name.ends_with(" per period"));
}

/// For who has not read how it is made; tables have the name by which a log is searched.
std::string plainNameOf(const TraitVerdict& one) {
  std::string what = one.what, name = one.difference.name;
  if (isWaves(one)) what = one.b ? "error over distance, B's less A's" : "B − A over distance";
  if (what == "noise law") what = "noise over signal";
  if (name == "residual") name = "what no wave explains";
  if (name.ends_with(" per period")) name = "wave, " + name;
  return what == name ? what : what + ": " + name;
}

std::string intervalOf(const Trait& one) {
  const auto end = [&](double value) { return isKnown(value, one.unit) ? number(value) : "not known"; };
  return fmt::format("{} ({} to {})", number(one.value), end(one.low), end(one.high));
}

std::string shownOf(const std::optional<NamedTrait>& one) {
  if (!one) return "";
  return number(one->trait.value) + (one->detail.empty() ? "" : ", " + one->detail);
}

std::string sizeOf(const TraitVerdict& one) {
  const double value = one.difference.value;
  return (value > 0.0 && !isSize(one) ? "+" : "") + number(value) + unitOf(one);
}

double timesFloor(const TraitVerdict& one) { return std::abs(one.difference.value) / one.floor(); }

std::string farBeyond(const TraitVerdict& one) {
  if (!(one.floor() > 0.0)) return "without a floor";
  return fmt::format("{:.{}f} × the floor", timesFloor(one), timesFloor(one) < 10.0 ? 1 : 0);
}

std::string atOf(const TraitVerdict& one) { return one.at.empty() ? "" : ", both " + one.at; }

std::string verdictOf(const TraitVerdict& one) {
  if (!one.why_not.empty()) return "not told: " + one.why_not;
  if (!one.isTold()) return "not told: an end of an interval is not known";
  if (one.differs()) return "differs, " + farBeyond(one) + atOf(one);
  const double most = std::max(std::abs(one.difference.low), std::abs(one.difference.high));
  return fmt::format("same, within {}{}{}", number(most), unitOf(one), atOf(one));
}

std::size_t countOf(const std::vector<TraitVerdict>& all, bool differs) {
  return static_cast<std::size_t>(
      std::ranges::count_if(all, [&](const auto& one) { return one.isTold() && one.differs() == differs; }));
}

void holdTogether(TraitVerdict& one, double wider) {
  if (!one.b) {
    one.difference = widened(one.difference, wider);
    return;
  }
  const Trait &a = one.a->trait, &b = one.b->trait;
  HeldTogether held = heldTogether(a, b, wider);
  one.is_size = held.is_size, one.at = std::move(held.at), one.why_not = std::move(held.why_not);
  one.difference = std::move(held.difference);
  if (!one.why_not.empty()) one.difference = {b.name, b.unit, kNaN, kNaN, kNaN, std::min(a.n, b.n)};
}

}  // namespace

bool TraitVerdict::isTold() const {
  const auto known = [&](double end) { return isKnown(end, difference.unit); };
  return known(difference.value) && known(difference.low) && known(difference.high);
}

double TraitVerdict::floor() const {
  return difference.value < 0.0 ? difference.high - difference.value : difference.value - difference.low;
}

std::vector<TraitVerdict> verdictsOf(const NamedTraits& traits) {
  using Key = std::pair<std::string, std::string>;
  std::map<Key, const NamedTrait*> of_a;
  for (const NamedTrait& one : traits.traits) {
    if (one.of == "A") of_a[{one.what, one.trait.name}] = &one;
  }
  std::vector<TraitVerdict> all;
  for (const NamedTrait& one : traits.traits) {
    if (isDifference(one)) all.push_back({.what = one.what, .difference = one.trait});
    const auto a = of_a.find({one.what, one.trait.name});
    if (one.of == "B" && a != of_a.end()) all.push_back({.what = one.what, .a = *a->second, .b = one});
  }
  const double wider = widenedFor(all.size());
  for (TraitVerdict& one : all) holdTogether(one, wider);
  // Wraps come first, as what wraps is in few of the others. Those that are not told come last; where a floor
  // is 0, what differs is infinitely far beyond it.
  const auto rank = [](const TraitVerdict& one) {
    if (isWraps(one)) return -std::numeric_limits<double>::infinity();
    return !one.isTold() ? 1.0 : one.differs() ? -timesFloor(one) : 0.0;
  };
  std::ranges::stable_sort(all, {}, rank);
  return all;
}

std::string headlineOf(const std::vector<TraitVerdict>& all) {
  const std::size_t differ = countOf(all, true), same = countOf(all, false);
  if (differ + same == 0) return "No characteristic is known of both cameras";
  if (differ == 0)
    return fmt::format("In none of {} numbers does B differ from A by more than the noise floor", same);
  // In millimetres where there is any: other units have no larger and smaller among them.
  const TraitVerdict* largest = nullptr;
  for (const TraitVerdict& one : all) {
    if (!one.isTold() || !one.differs() || one.difference.unit != "mm") continue;
    if (largest == nullptr || std::abs(one.difference.value) > std::abs(largest->difference.value))
      largest = &one;
  }
  const TraitVerdict& first = largest != nullptr ? *largest : all.front();
  return fmt::format(
      "{} difference: {}, {} ({} to {}). {} of {} numbers of B differ from A's by more than the noise "
      "floor",
      largest != nullptr ? "Largest" : "Clearest", plainNameOf(first), sizeOf(first),
      number(first.difference.low), number(first.difference.high), differ, differ + same);
}

TableBlock verdictTable(const std::vector<TraitVerdict>& all) {
  TableBlock table{
      "B against A, number by number. The floor is what B − A is uncertain by: a smaller difference does not "
      "show. "
      "Intervals of B − A hold with 95 % for all rows together",
      {"characteristic", "verdict", "B − A", "floor", "A", "B"},
      {}};
  for (const TraitVerdict& one : all) {
    const std::string unit = unitOf(one).empty() ? "" : fmt::format(" [{}]", one.difference.unit);
    table.rows.push_back({nameOf(one) + unit, verdictOf(one), intervalOf(one.difference),
                          one.isTold() ? number(one.floor()) : "–", shownOf(one.a), shownOf(one.b)});
  }
  return table;
}

std::pair<TableBlock, TableBlock> verdictTables(const std::vector<TraitVerdict>& all) {
  const auto differs = [](const TraitVerdict& one) { return one.isTold() && one.differs(); };
  const auto first_same = std::ranges::find_if_not(all, differs);  // those that differ come first
  auto differ = verdictTable({all.begin(), first_same}), rest = verdictTable({first_same, all.end()});
  if (!differ.rows.empty()) rest.caption = "The other numbers: B is the same as A within the noise floor, or it is not told";
  return {std::move(differ), std::move(rest)};
}

std::vector<Card> cardsOf(const std::vector<TraitVerdict>& all) {
  const std::size_t differ = countOf(all, true), told = differ + countOf(all, false);
  if (told == 0) return {};
  std::vector<Card> cards{{"Same as A", fmt::format("{} of {}", told - differ, told),
                           "numbers of B within the noise floor", differ == 0 ? Tone::Good : Tone::Fair}};
  for (std::size_t i = 0; i < differ && cards.size() <= kShownFirst; ++i) {
    const TraitVerdict& one = all[i];
    // What is told of waves of B − A and again of B's less A's has one card, that of what is clearer.
    const auto isIt = [&](const TraitVerdict& before) {
      return isWaves(before) && isWaves(one) && before.difference.name == one.difference.name;
    };
    if (std::any_of(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(i), isIt)) continue;
    cards.push_back({plainNameOf(one), sizeOf(one),
                     fmt::format("B − A, {} to {}; {}", number(one.difference.low),
                                 number(one.difference.high), farBeyond(one)),
                     Tone::Fair});
  }
  return cards;
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
                                        : "same");
    rows.push(std::move(row));
  }
  return rows;
}

}  // namespace toftwin::compare
