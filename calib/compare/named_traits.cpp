// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/named_traits.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace toftwin::compare {

void TraitCollector::add(const std::string& what, const char* of, const Traits& traits,
                         const std::string& detail) {
  if (!traits) {
    found_.untold.push_back(fmt::format("{} of {}: {}", what, of, traits.error().message));
    return;
  }
  for (const Trait& trait : *traits) found_.traits.push_back({what, detail, of, trait});
}

void TraitCollector::add(const std::string& what, const char* of, const Result<DriftTraits>& drift) {
  if (drift) return add(what, of, drift->traits, nameOf(drift->model));
  add(what, of, Traits{drift.error()});
}

const char* nameOf(DriftModel model) {
  switch (model) {
    case DriftModel::Constant:
      return "none";
    case DriftModel::Ramp:
      return "ramp";
    case DriftModel::OneExponential:
      return "one exponential";
    case DriftModel::TwoExponentials:
      return "two exponentials";
    case DriftModel::Step:
      return "step";
  }
  return "";
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
  for (const auto& [what, detail, of, trait] : traits.traits) {
    const std::pair key{what, trait.name};
    auto row = static_cast<std::size_t>(std::ranges::find(keys, key) - keys.begin());
    if (row == keys.size()) {
      keys.push_back(key);
      table.rows.push_back({what, trait.name, trait.unit, "", ""});
      if (has_both) table.rows.back().emplace_back();
    }
    table.rows[row][of == "A"   ? 3
                    : of == "B" ? 4
                                : 5] =
        fmt::format("{:.4g} ({:.4g} to {:.4g}) #{}{}{}", trait.value, trait.low, trait.high, trait.n,
                    detail.empty() ? "" : ", ", detail);
  }
  return table;
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
    rows.push(std::move(row));
  }
  for (const std::string& text : traits.untold) untold.push(text);
  Json json = Json::object();
  json.set("rows", std::move(rows)).set("untold", std::move(untold));
  return json;
}

}  // namespace toftwin::compare
