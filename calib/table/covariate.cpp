// SPDX-License-Identifier: Apache-2.0
#include "calib/table/covariate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include <fmt/format.h>

#include "calib/table/number.h"
#include "calib/table/times.h"
#include "calib/table/units.h"
#include "calib/table/words.h"

namespace toftwin::table {
namespace {

bool areWhole(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double v) { return !std::isfinite(v) || v == std::floor(v); });
}

/// Whether a column of numbers names groups: few whole numbers under a word for groups or devices.
bool namesGroups(const TableColumn& column) {
  constexpr std::size_t kMostNames = 60, kRowsPerName = 3;
  const bool is_word = says(column.stem, Meaning::Session) || says(column.stem, Meaning::Device);
  if (!is_word || !column.unit.empty() || !areWhole(column.values)) return false;
  const std::set<double> names(column.values.begin(), column.values.end());
  return names.size() <= kMostNames && kRowsPerName * names.size() <= column.values.size();
}

bool isOf(const TableColumn& column, Quantity quantity) {
  const Unit* unit = findUnit(column.unit);
  return unit != nullptr && unit->quantity == quantity;
}

bool isCalledTime(const TableColumn& column) {
  const bool has_other_unit = !column.unit.empty() && !isOf(column, Quantity::Time);
  // "data" is a date in Italian only.
  return strengthOf(column.stem, Meaning::Time) > 1 && !says(column.stem, Meaning::NoTime) && !has_other_unit;
}

Nature natureOf(const TableColumn& column) {
  if (column.kind == Kind::Text || namesGroups(column)) return Nature::Category;
  if (column.kind == Kind::Time || isCalledTime(column)) return Nature::Time;
  const bool is_count = column.unit.empty() || isOf(column, Quantity::Pixels);
  if (is_count && says(column.stem, Meaning::Pixel) && areWhole(column.values)) return Nature::Index;
  if (isOf(column, Quantity::Length) || (column.unit.empty() && says(column.stem, Meaning::Length)))
    return Nature::Length;
  if (isOf(column, Quantity::Angle) || (column.unit.empty() && says(column.stem, Meaning::Angle)))
    return Nature::Angle;
  return is_count && says(column.stem, Meaning::Index) ? Nature::Index : Nature::Number;
}

Nature natureSaid(const TableColumn& column, MapNature said) {
  switch (said) {
    case MapNature::Plain:
      return Nature::Number;
    case MapNature::Time:
      return Nature::Time;
    case MapNature::Distance:
      return Nature::Length;
    case MapNature::Angle:
      return Nature::Angle;
    case MapNature::Index:
      return Nature::Index;
    case MapNature::Category:
      return Nature::Category;
    case MapNature::Guessed:
      break;
  }
  return natureOf(column);
}

/// The unit that values of this nature are in, and what they are multiplied with.
void convert(Column& column, Quantity quantity, const char* unit) {
  const Unit* there = findUnit(column.unit);
  if (there == nullptr || there->quantity != quantity) return;
  const double factor = factorBetween(column.unit, unit);
  column.written.factor = factor;
  if (factor != 1.0)
    for (double& value : column.values) value *= factor;
  column.unit = unit;
}

double leastOf(const std::vector<double>& values) {
  double least = std::numeric_limits<double>::infinity();
  for (const double value : values) least = std::fmin(least, value);
  return least;
}

void countFromFirst(Column& column) {
  const double first = leastOf(column.values);
  if (!std::isfinite(first)) return;
  column.first = first;
  for (double& value : column.values) value -= first;
}

/// Dates and times of day count from their first; numbers since 1970 and a spreadsheet's days, too.
void makeTime(const TableColumn& from, Column& column, std::vector<std::string>& notes) {
  if (from.kind == Kind::Time) {
    column.unit = "s";
    countFromFirst(column);
    return;
  }
  const bool is_said = isOf(from, Quantity::Time);
  const auto epoch = epochOf(from.values, !is_said);
  if (epoch && (!is_said || epoch->seconds_per_unit == findUnit(from.unit)->in_base)) {
    for (double& value : column.values) value = epoch->offset_s + epoch->seconds_per_unit * value;
    column.unit = "s";
    countFromFirst(column);
    notes.push_back(fmt::format("column \"{}\" is read as {}", column.header, epoch->name));
    return;
  }
  convert(column, Quantity::Time, "s");
}

Error noTime(const Table& table, std::size_t column) {
  return table.errorAt(
      column, table.firstTextIn(column),
      "is not read as a time, as its header says. Write 2026-05-01T10:15:30+02:00, 10:15:30 or seconds; or "
      "say in a map what it is: ignore = [\"…\"], or nature = \"category\" (docs/tables.md)");
}

}  // namespace

Column categoryOf(const Table& table, std::size_t column) {
  Column category{.header = table.columns[column].header, .nature = Nature::Category};
  std::map<std::string_view, double> known;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const std::string_view word = table.text(column, row);
    if (saysNothingAmongNames(word)) {
      category.values.push_back(std::nan(""));
      continue;
    }
    const auto [at, is_new] = known.try_emplace(word, static_cast<double>(known.size()));
    if (is_new) category.words.emplace_back(word);
    category.values.push_back(at->second);
  }
  return category;
}

Result<Column> covariateOf(const Table& table, std::size_t at, MapNature said, bool is_group,
                           std::vector<std::string>& notes) {
  const TableColumn& from = table.columns[at];
  const Nature nature = is_group ? Nature::Category : natureSaid(from, said);
  const bool must_be_time = said == MapNature::Time || (said == MapNature::Guessed && isCalledTime(from));
  if (!is_group && from.kind == Kind::Text && must_be_time) return noTime(table, at);
  if (nature == Nature::Category) return categoryOf(table, at);
  auto values = table.numbers(at);
  if (!values) return values.error();
  Column column{.header = from.header, .unit = from.unit, .nature = nature, .values = *std::move(values)};
  column.written.unit = from.unit;
  if (nature == Nature::Time || from.kind == Kind::Time) makeTime(from, column, notes);
  if (nature == Nature::Length) convert(column, Quantity::Length, "mm");
  if (nature == Nature::Angle) convert(column, Quantity::Angle, "deg");
  if (!from.note.empty()) notes.push_back(fmt::format("column \"{}\": {}", from.header, from.note));
  return column;
}

}  // namespace toftwin::table
