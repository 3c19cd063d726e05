// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/column_units.h"

#include <algorithm>
#include <array>
#include <cctype>

#include <fmt/format.h>

#include "calib/table/number.h"
#include "calib/table/records.h"

namespace toftwin::compare {
namespace {

/// Short words that end names of columns and are none of units.
constexpr std::array<std::string_view, 25> kNoUnits{
    "raw", "ref", "est", "sim", "off", "avg", "mean", "med", "max", "std", "sd", "rms", "err",
    "rel", "abs", "cam", "val", "sum", "new", "old",  "a",   "b",   "x",   "y",  "z"};

/// A last word that may well be meant as a unit: short, or one thing per another.
std::string_view unknownEndOf(std::string_view name) {
  if (const auto per = table::folded(name).rfind("_per_"); per != std::string::npos) {
    const auto before = per == 0 ? std::string::npos : name.find_last_of("_ -", per - 1);
    return name.substr(before == std::string::npos ? 0 : before + 1);
  }
  const auto last = name.find_last_of("_ -");
  if (last == std::string_view::npos) return {};
  const std::string_view word = name.substr(last + 1);
  const std::string small = table::folded(word);
  const bool is_number = std::ranges::all_of(word, [](unsigned char c) { return std::isdigit(c) != 0; });
  const bool is_word = std::ranges::find(kNoUnits, small) != kNoUnits.end();
  constexpr std::size_t kLongest = 3;
  return word.size() > kLongest || is_number || is_word ? std::string_view{} : word;
}

}  // namespace

const table::Unit* unitOf(std::string_view column) { return table::unitOfHeader(column).known(); }

ColumnName columnNameOf(std::string_view given) {
  ColumnName column;
  given = table::trimmed(given);
  if (given.starts_with('-')) column.is_negated = true, given.remove_prefix(1);
  if (const auto equals = given.rfind('='); equals != std::string_view::npos) {
    column.unit = table::trimmed(given.substr(equals + 1));
    column.in_file = given.substr(0, equals);
    column.is_certain = true;
    return column;
  }
  column.in_file = given;
  const table::HeaderUnit said = table::unitOfHeader(given);
  column.unit = said.unit.empty() ? std::string{unknownEndOf(given)} : said.unit;
  column.is_certain = said.is_certain;
  return column;
}

Result<std::optional<double>> factorOf(const ColumnName& there, std::string_view wanted) {
  const table::Unit* to = unitOf(wanted);
  if (to == nullptr) return std::optional{1.0};
  const auto refuse = [&](const std::string& why) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("column \"{}\" cannot stand for {}: {}; known are {}, and \"{}={}\" says one",
                    there.in_file, wanted, why, table::namesOf(to->quantity), there.in_file, to->name)};
  };
  if (there.unit.empty() && !there.is_certain) return std::optional<double>{};
  const table::Unit* from = table::findUnit(there.unit);
  if (from == nullptr) return refuse(fmt::format("its unit \"{}\" is not known", there.unit));
  if (from->quantity == to->quantity) return std::optional{from->in_base / to->in_base};
  // A name that is one letter, "d" or "h", is a symbol rather than a unit.
  if (!there.is_certain && there.unit.size() == 1 && there.unit.size() == there.in_file.size())
    return std::optional<double>{};
  return refuse(fmt::format("its unit \"{}\" is of another quantity", there.unit));
}

}  // namespace toftwin::compare
