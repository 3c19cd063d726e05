// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/trait_verdict.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

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

std::string withSign(double value) { return (value > 0.0 ? "+" : "") + number(value); }

std::string unitOf(const TraitVerdict& one) {
  return one.difference.unit.empty() || one.difference.unit == "1" ? "" : " " + one.difference.unit;
}

std::string nameOf(const TraitVerdict& one) {
  return one.what == one.difference.name ? one.what : one.what + ": " + one.difference.name;
}

/// For who has not read how it is made; tables have the name by which a log is searched.
std::string plainNameOf(const TraitVerdict& one) {
  std::string what = one.what, name = one.difference.name;
  if (what.starts_with("harmonics")) what = "error over distance";
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

double timesFloor(const TraitVerdict& one) { return std::abs(one.difference.value) / one.floor(); }

std::string farBeyond(const TraitVerdict& one) {
  if (!(one.floor() > 0.0)) return "without a floor";
  return fmt::format("{:.{}f} × the floor", timesFloor(one), timesFloor(one) < 10.0 ? 1 : 0);
}

std::string verdictOf(const TraitVerdict& one) {
  if (!one.isTold()) return "not told: an end of an interval is not known";
  if (one.differs()) return "differs, " + farBeyond(one);
  const double most = std::max(std::abs(one.difference.low), std::abs(one.difference.high));
  return fmt::format("same, within {}{}", number(most), unitOf(one));
}

std::size_t countOf(const std::vector<TraitVerdict>& all, bool differs) {
  return static_cast<std::size_t>(
      std::ranges::count_if(all, [&](const auto& one) { return one.isTold() && one.differs() == differs; }));
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
  for (TraitVerdict& one : all)
    one.difference = one.b ? differenceOf(one.a->trait, one.b->trait, wider) : widened(one.difference, wider);
  // Those that are not told come last; where a floor is 0, what differs is infinitely far beyond it.
  const auto rank = [](const TraitVerdict& one) {
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
      "{} difference: {}, {}{} ({} to {}). {} of {} numbers of B differ from A's by more than the noise "
      "floor",
      largest != nullptr ? "Largest" : "Clearest", plainNameOf(first), withSign(first.difference.value),
      unitOf(first), number(first.difference.low), number(first.difference.high), differ, differ + same);
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
  for (std::size_t i = 0; i < std::min(differ, kShownFirst); ++i) {
    const TraitVerdict& one = all[i];
    cards.push_back({plainNameOf(one), withSign(one.difference.value) + unitOf(one),
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
