// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/without_odd_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "calib/compare/traits/difference.h"
#include "calib/compare/verdict_words.h"

namespace toftwin::compare {
namespace {

/// As a person counts them.
std::vector<std::size_t> numbersOf(const OddRowsOfTable& table) {
  std::vector<std::size_t> numbers;
  for (const std::size_t row : table.rows) numbers.push_back(row + 1);
  return numbers;
}

/// "row 45 of B".
std::string nameOf(const OddRowsOfTable& table) {
  return fmt::format("row{} {} of {}", table.rows.size() == 1 ? "" : "s", fmt::join(numbersOf(table), ", "), table.of);
}

std::string namesOf(const std::vector<OddRowsOfTable>& tables) {
  std::vector<std::string> names;
  for (const OddRowsOfTable& one : tables) names.push_back(nameOf(one));
  return fmt::format("{}", fmt::join(names, " and "));
}

std::string shownOf(const NamedTrait& one) {
  const auto end = [&](double value) {
    return isKnown(value, one.trait.unit) ? shownDigits(value, 4) : std::string{"not known"};
  };
  return fmt::format("{} ({} to {}){}{}{}", shownDigits(one.trait.value, 4), end(one.trait.low), end(one.trait.high),
                     one.detail.empty() ? "" : ", ", one.detail, one.trait.doubt.empty() ? "" : ", in doubt");
}

}  // namespace

std::vector<OddRowsOfTable> oddRowsOfTables(const NamedTraits& traits) {
  std::vector<OddRowsOfTable> tables;
  for (const char* of : {"A", "B"}) {
    OddRowsOfTable table{.of = of};
    for (const NamedTrait& one : traits.traits)
      if (one.of == of) table.rows.insert(table.rows.end(), one.trait.odd_rows.begin(), one.trait.odd_rows.end());
    std::ranges::sort(table.rows);
    const auto same = std::ranges::unique(table.rows);
    table.rows.erase(same.begin(), same.end());
    if (!table.rows.empty()) tables.push_back(std::move(table));
  }
  return tables;
}

std::string inWords(const WithoutOddRows& without) {
  return fmt::format("Without {}: {}", namesOf(without.left_out),
                     without.verdicts.empty() ? clearestOf(without.traits) : headlineOf(without.verdicts));
}

TableBlock besideAllRows(const NamedTraits& all, const WithoutOddRows& without) {
  TableBlock table{fmt::format("The same numbers with all rows, and without {}", namesOf(without.left_out)),
                   {"number", "table", "all rows", "without"},
                   {}};
  for (const OddRowsOfTable& of : without.left_out) {
    for (const NamedTrait& one : all.traits) {
      if (one.of != of.of) continue;
      const auto isIt = [&](const NamedTrait& other) {
        return other.of == one.of && other.what == one.what && other.trait.name == one.trait.name;
      };
      const auto found = std::ranges::find_if(without.traits.traits, isIt);
      const std::string unit = one.trait.unit.empty() ? "" : fmt::format(" [{}]", one.trait.unit);
      table.rows.push_back({one.trait.name + unit, one.of, shownOf(one),
                            found == without.traits.traits.end() ? "not told" : shownOf(*found)});
    }
  }
  return table;
}

Json toJson(const WithoutOddRows& without) {
  Json left_out = Json::object(), json = Json::object();
  for (const OddRowsOfTable& table : without.left_out) {
    Json rows = Json::array();
    for (const std::size_t number : numbersOf(table)) rows.push(number);
    left_out.set(table.of, std::move(rows));
  }
  json.set("left_out", std::move(left_out)).set("characteristics", toJson(without.traits));
  return json.set("verdicts", toJson(without.verdicts));
}

}  // namespace toftwin::compare
