// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/named_traits.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "calib/compare/traits/common_reference.h"
#include "calib/compare/traits/difference.h"

namespace toftwin::compare {

void TraitCollector::add(const std::string& what, const std::string& of, const Traits& traits,
                         const std::string& detail) {
  if (!traits) {
    found_.untold.push_back(fmt::format("{} of {}: {}", what, of, traits.error().message));
    return;
  }
  for (const Trait& trait : *traits) found_.traits.push_back({what, detail, of, trait});
}

void TraitCollector::draw(NamedRows rows) {
  NamedRows kept{rows.what, rows.of, {}, {}, {}, std::move(rows.curve)};
  for (std::size_t i = 0; i < rows.x.size(); ++i) {
    if (!std::isfinite(rows.x[i]) || !std::isfinite(rows.y[i])) continue;
    kept.x.push_back(rows.x[i]), kept.y.push_back(rows.y[i]);
    if (!rows.condition.empty()) kept.condition.push_back(rows.condition[i]);
  }
  found_.rows.push_back(std::move(kept));
}

void TraitCollector::add(const std::string& what, const std::string& of, const Result<FittedTraits>& fitted) {
  add(what, of, fitted ? Traits{fitted->traits} : Traits{fitted.error()});
  if (fitted && !fitted->not_told.empty())
    found_.untold.push_back(fmt::format("{} of {}: {}", what, of, fitted->not_told));
}

void TraitCollector::add(NamedRows rows, const Result<FittedTraits>& fitted) {
  add(rows.what, rows.of, fitted);
  if (fitted) rows.curve = fitted->curve;
  for (std::size_t i = 0; fitted && i < fitted->besides.size(); ++i) rows.y[i] -= fitted->besides[i];
  draw(std::move(rows));
}

void TraitCollector::add(NamedRows rows, const Result<DriftTraits>& drift) {
  add(rows.what, rows.of, drift ? Traits{drift->traits} : Traits{drift.error()},
      drift ? nameOf(drift->model) : "");
  if (drift && !drift->not_told.empty())
    found_.untold.push_back(fmt::format("{} of {}: {}", rows.what, rows.of, drift->not_told));
  if (drift) rows.curve = drift->curve;
  draw(std::move(rows));
}

namespace {

/// The last of details, in this order.
constexpr std::string_view kUnseen = "not seen by itself", kInDoubt = "in doubt";

std::string endOf(const Trait& trait, double end) {
  return isKnown(end, trait.unit) ? shownDigits(end, 4) : "not known";
}

std::string intervalOf(const Trait& trait) {
  if (!isKnown(trait.low, trait.unit) && !isKnown(trait.high, trait.unit)) return "interval not known";
  return fmt::format("{} to {}", endOf(trait, trait.low), endOf(trait, trait.high));
}

}  // namespace

std::string detailsOf(const NamedTrait& one) {
  std::string all = one.detail;
  const auto add = [&all](std::string_view text) { (all += all.empty() ? "" : ", ") += text; };
  if (const auto* line = std::get_if<OnLine>(&one.trait.refers_to)) add(placeInWords(line->at_m));
  if (const AtSignal* at = signalOf(one.trait); at != nullptr && !at->place.empty()) add(kAtSignalOf + at->place);
  if (isUnseenPart(one)) add(kUnseen);
  if (!one.trait.doubt.empty()) add(kInDoubt);
  return all;
}

bool isUnseenPart(const NamedTrait& one) {
  const auto isIt = [&](const char* part) { return one.trait.name == part; };
  return (std::ranges::any_of(kLawParts, isIt) || std::ranges::any_of(kPatternParts, isIt)) &&
         one.trait.value == 0.0 && one.trait.high > 0.0;
}

bool isInDoubt(std::string_view details) { return details.ends_with(kInDoubt); }

std::string withoutDoubt(std::string_view details) {
  for (const std::string_view doubt : {kInDoubt, kUnseen}) {
    if (!details.ends_with(doubt)) continue;
    details.remove_suffix(doubt.size());
    if (details.ends_with(", ")) details.remove_suffix(2);
  }
  return std::string{details};
}

TableBlock traitTable(const NamedTraits& traits, const std::string& a, const std::string& b) {
  TableBlock table{
      "Characteristics, with the intervals that are to hold them with 95 % and, behind a #, the number of "
      "rows, frames or "
      "blocks they are from: see docs/characteristics.md",
      {"characteristic", "number", "unit", a, b, "B − A, or both"},
      {}};
  const auto isOfBoth = [](const NamedTrait& one) { return one.of != "A" && one.of != "B"; };
  const bool has_both = std::ranges::any_of(traits.traits, isOfBoth);
  if (!has_both) table.header.pop_back();
  std::vector<std::pair<std::string, std::string>> keys;
  for (const NamedTrait& one : traits.traits) {
    const Trait& trait = one.trait;
    const std::string details = detailsOf(one);
    const std::pair key{one.what, trait.name};
    auto row = static_cast<std::size_t>(std::ranges::find(keys, key) - keys.begin());
    if (row == keys.size()) {
      keys.push_back(key);
      table.rows.push_back({one.what, trait.name, trait.unit, "", ""});
      if (has_both) table.rows.back().emplace_back();
    }
    table.rows[row][one.of == "A"   ? 3
                    : one.of == "B" ? 4
                                    : 5] =
        fmt::format("{} ({}) #{}{}{}", shownDigits(trait.value, 4), intervalOf(trait), trait.n,
                    details.empty() ? "" : ", ", details);
  }
  const auto isOfB = [](const NamedTrait& one) { return one.of == "B"; };
  if (!has_both && std::ranges::none_of(traits.traits, isOfB)) {  // a page of one table
    table.header.pop_back();
    for (auto& row : table.rows) row.pop_back();
  }
  return table;
}

std::string clearestOf(const NamedTraits& traits) {
  const NamedTrait* clearest = nullptr;
  double farthest = 0.0;
  for (const NamedTrait& one : traits.traits) {
    const Trait& trait = one.trait;
    const double error = 0.5 * (trait.high - trait.low);
    const bool is_apart = trait.low > 0.0 || trait.high < 0.0;
    if (!is_apart || !trait.doubt.empty() || trait.is_extrapolated) continue;
    // Without an error, as of a number that all rows have alike, it is farther than any other.
    if (const double far = std::abs(trait.value) / error; far > farthest) farthest = far, clearest = &one;
  }
  const std::size_t count = traits.traits.size();
  const auto isInDoubt = [](const NamedTrait& one) { return !one.trait.doubt.empty(); };
  if (std::ranges::all_of(traits.traits, isInDoubt))
    return count == 1 ? "The one number told is in doubt" : fmt::format("All {} numbers told are in doubt", count);
  if (clearest == nullptr)
    return fmt::format("{} certain to be other than 0",
                       count == 1 ? "The one number told is not" : fmt::format("None of {} numbers told is", count));
  const Trait& trait = clearest->trait;
  const std::string unit = trait.unit.empty() || trait.unit == "1" ? "" : " " + trait.unit;
  std::string what = clearest->what == trait.name ? "" : clearest->what + ", ";
  std::ranges::replace(what, '_', ' ');
  return fmt::format("{}{}: {}{} ({} to {}){}", what, trait.name, shownDigits(trait.value, 3), unit,
                     shownDigits(trait.low, 3), shownDigits(trait.high, 3),
                     count == 1 ? "" : fmt::format(", the clearest of {} numbers", count));
}

Details whatIsNotTold(const std::string& summary, const NamedTraits& traits) {
  return {fmt::format("{} ({})", summary, traits.untold.size()), traits.untold};
}

Json toJson(const NamedTraits& traits) {
  Json rows = Json::array(), untold = Json::array();
  for (const auto& [what, detail, of, trait] : traits.traits) {
    Json row = Json::object();
    row.set("characteristic", what)
        .set("detail", detail)
        .set("of", of)
        .set("name", trait.name)
        .set("unit", trait.unit);
    row.set("value", trait.value).set("low", trait.low).set("high", trait.high).set("n", trait.n);
    if (!trait.doubt.empty()) row.set("doubt", trait.doubt);
    if (const auto* line = std::get_if<OnLine>(&trait.refers_to)) row.set("at_m", line->at_m);
    rows.push(std::move(row));
  }
  for (const std::string& text : traits.untold) untold.push(text);
  Json json = Json::object();
  json.set("rows", std::move(rows)).set("untold", std::move(untold));
  if (traits.missing.empty()) return json;
  Json missing = Json::array();
  for (const MissingAt& one : traits.missing) {
    Json row = Json::object();
    row.set("condition", one.at).set("of", one.of).set("share", one.share).set("captures", one.captures);
    missing.push(std::move(row));
  }
  json.set("missing", std::move(missing));
  return json;
}

}  // namespace toftwin::compare
