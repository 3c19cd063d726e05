// SPDX-License-Identifier: Apache-2.0
#include "calib/table/column.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "calib/table/records.h"
#include "calib/table/times.h"
#include "calib/table/units.h"

namespace toftwin::table {
namespace {

/// Which sign is the decimal one; why it is not known.
struct DecimalSign {
  char sign = '.';
  Signs unclear = Signs::NoNumber;  ///< the fields that may be thousands or fractions
  std::string note{};
};

DecimalSign decimalSignOf(const SignCounts& counts, const DecimalEvidence& others, char delimiter) {
  const bool has_points = counts.of(Signs::EitherOfPoint) > 0,
             has_commas = counts.of(Signs::EitherOfComma) > 0;
  if (counts.point() + counts.comma() > 0) return {.sign = counts.point() >= counts.comma() ? '.' : ','};
  const bool is_comma_table = others.has_comma && !others.has_point,
             is_point_table = others.has_point && !others.has_comma;
  if (has_points && has_commas) return {.unclear = Signs::EitherOfComma};
  if (has_points) {
    if (!is_comma_table) return {.sign = '.'};
    return {.sign = ',', .note = "its points part thousands, as decimal signs are commas elsewhere"};
  }
  if (!has_commas) return {.sign = is_comma_table ? ',' : '.'};
  if (is_point_table)
    return {.sign = '.', .note = "its commas part thousands, as decimal signs are points elsewhere"};
  const bool has_whole = counts.of(Signs::Whole) > 0;
  if (has_whole || (delimiter == ',' && !is_comma_table))
    return {.sign = ',', .unclear = Signs::EitherOfComma};
  return {.sign = ','};
}

/// "21.3 °C" in every field: a unit behind each number.
std::optional<std::pair<ColumnFields, std::string_view>> withoutUnits(const ColumnFields& fields) {
  ColumnFields numbers;
  std::string_view unit;
  for (const std::string_view field : fields) {
    if (saysNothing(field)) {
      numbers.push_back(field);
      continue;
    }
    const std::size_t last = field.find_last_of("0123456789");
    if (last == std::string_view::npos) return std::nullopt;
    const std::string_view behind = trimmed(field.substr(last + 1));
    if (behind.empty() || (!unit.empty() && behind != unit) || findUnit(behind) == nullptr)
      return std::nullopt;
    unit = behind;
    numbers.push_back(field.substr(0, last + 1));
    if (signsOf(numbers.back()) == Signs::NoNumber) return std::nullopt;
  }
  if (unit.empty()) return std::nullopt;
  return std::pair{std::move(numbers), unit};
}

std::string adviceFor(std::string_view field, char decimal_sign, char delimiter) {
  if (signsOf(field) != Signs::NoNumber) {
    return fmt::format("has another decimal sign than most of its column, '{}': write all numbers alike",
                       decimal_sign);
  }
  return delimiter == ',' || field.find_first_of("0123456789") == std::string_view::npos
             ? "is not a number: leave the field empty where there is none"
             : "is not a number: leave the field empty where there is none, and write no marks between "
               "thousands";
}

void readNumbers(const ColumnFields& fields, const DecimalSign& decimal, char delimiter,
                 TableColumn& column) {
  column.kind = Kind::Number, column.decimal_sign = decimal.sign, column.note = decimal.note;
  column.values.reserve(fields.size());
  for (std::size_t row = 0; row < fields.size(); ++row) {
    const auto value = numberIn(fields[row], decimal.sign);
    if (!value && !column.odd) column.odd = OddField{row, adviceFor(fields[row], decimal.sign, delimiter)};
    column.values.push_back(value.value_or(std::nan("")));
  }
  if (decimal.unclear == Signs::NoNumber) return;
  const auto at =
      std::ranges::find_if(fields, [&](std::string_view field) { return signsOf(field) == decimal.unclear; });
  column.odd = OddField{static_cast<std::size_t>(at - fields.begin()),
                        "may be a thousand or a fraction; write it without the comma, or all with decimals"};
}

}  // namespace

SignCounts signCounts(const ColumnFields& fields) {
  SignCounts counts{.rows = fields.size()};
  for (const std::string_view field : fields) {
    if (saysNothing(field)) {
      ++counts.nothing;
    } else {
      ++counts.count[static_cast<std::size_t>(signsOf(field))];
    }
  }
  return counts;
}

DecimalEvidence evidenceIn(const SignCounts& counts) {
  if (2 * counts.of(Signs::NoNumber) > counts.numbers()) return {};
  return {counts.point() > 0 && counts.point() >= counts.comma(), counts.comma() > counts.point()};
}

void readColumn(const ColumnFields& fields, const SignCounts& counts, const DecimalEvidence& others,
                char delimiter, TableColumn& column) {
  constexpr std::size_t kNumbersPerText =
      4;  // a column of numbers with more texts than one in five holds names
  const std::size_t texts = counts.of(Signs::NoNumber), numbers = counts.numbers();
  if (texts == 0 || numbers >= kNumbersPerText * texts) {
    readNumbers(fields, decimalSignOf(counts, others, delimiter), delimiter, column);
    return;
  }
  if (auto times = timesIn(fields)) {
    column.kind = Kind::Time, column.values = std::move(times->seconds);
    column.has_dates = times->has_dates, column.note = std::move(times->note);
    return;
  }
  if (const auto stripped = withoutUnits(fields)) {
    const SignCounts inner = signCounts(stripped->first);
    readNumbers(stripped->first, decimalSignOf(inner, others, delimiter), delimiter, column);
    const Unit* unit = findUnit(stripped->second);
    if (column.unit.empty() && unit != nullptr) column.unit = unit->name, column.is_unit_certain = true;
  }
}

}  // namespace toftwin::table
