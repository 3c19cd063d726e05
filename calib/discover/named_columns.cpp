// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/named_columns.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "calib/discover/table_field.h"

namespace toftwin::discover {
namespace {

/// Times of day that fall by more than half a day are those of the next one. Dates do not fall so.
void overMidnight(std::vector<double>& seconds) {
  constexpr double kDay = 86'400.0;
  double days = 0.0, before = std::nan("");
  for (double& value : seconds) {
    if (std::isnan(value) || value > kDay) continue;
    if (value < before - 0.5 * kDay) days += kDay;
    before = value;
    value += days;
  }
}

}  // namespace

std::optional<std::size_t> NamedColumns::find(const std::string& name) const {
  const auto at = std::ranges::find(table_.header, name);
  if (at == table_.header.end()) return std::nullopt;
  return static_cast<std::size_t>(at - table_.header.begin());
}

Error NamedColumns::missing(const std::string& name) const {
  return {Error::Code::NotFound, fmt::format("{}: has no column \"{}\", only: {}", file_.string(), name,
                                             fmt::join(table_.header, ", "))};
}

Result<std::vector<double>> NamedColumns::numbers(const std::string& name) const {
  auto values = asWritten(name);
  if (values && isTime(name))
    for (const double first = firstOf(*values); double& value : *values) value -= first;
  return values;
}

double NamedColumns::firstOf(const std::vector<double>& values) {
  double first = std::numeric_limits<double>::infinity();
  for (const double value : values) first = std::fmin(first, value);
  return first;
}

Result<std::vector<double>> NamedColumns::asWritten(const std::string& name) const {
  const auto at = find(name);
  if (!at) return missing(name);
  const bool is_time = isTime(name);
  std::vector<double> values;
  for (std::size_t row = 0; row < table_.rows(); ++row) {
    const std::string& field = table_.columns[*at][row];
    const auto number = toNumber(field), value = number || !is_time ? number : secondsIn(field);
    if (!value) return notIn(*at, row, fmt::format("is not a number: {}", adviceFor(*at, row)));
    values.push_back(*value);
  }
  if (const auto row = thousandOrNot(*at)) {
    return notIn(*at, *row, "may be a thousand or a fraction, beside whole numbers; write it without the comma, or "
                            "all with decimals");
  }
  if (is_time) overMidnight(values);
  return values;
}

Error NamedColumns::notIn(std::size_t column, std::size_t row, std::string_view what) const {
  return {Error::Code::Malformed,
          fmt::format("{}:{}: \"{}\" in column \"{}\" {}", file_.string(), table_.line[row],
                      table_.columns[column][row].substr(0, 40), table_.header[column], what)};
}

std::string_view NamedColumns::adviceFor(std::size_t column, std::size_t row) const {
  if (hasThousandsPoint(table_.columns[column][row])) return "write it without the points that part thousands";
  if (row == 0 && beginsWithTexts())
    return "if this line says units, begin it with # and end the headers in them, as in depth_mm";
  return "leave the field empty where there is none";
}

bool NamedColumns::beginsWithTexts() const {
  return std::ranges::all_of(table_.columns, [&](const std::vector<std::string>& column) {
    const auto number = toNumber(column.front());
    return !number || std::isnan(*number);
  });
}

Result<std::vector<bool>> NamedColumns::flags(const std::string& name) const {
  const auto at = find(name);
  if (!at) return missing(name);
  std::vector<bool> values;
  for (std::size_t row = 0; row < table_.rows(); ++row) {
    const auto flag = flagIn(table_.columns[*at][row]);
    if (!flag) return notIn(*at, row, "is neither 1 nor 0, yes nor no, true nor false");
    values.push_back(*flag);
  }
  return values;
}

std::optional<std::size_t> NamedColumns::thousandOrNot(std::size_t column) const {
  if (table_.separator == ',') return std::nullopt;
  bool has_whole = false;
  std::optional<std::size_t> first;
  for (std::size_t row = 0; row < table_.rows(); ++row) {
    std::string_view field = table_.columns[column][row];
    if (!field.empty() && (field.front() == '-' || field.front() == '+')) field.remove_prefix(1);
    const bool is_number = !field.empty() && field.find_first_not_of("0123456789,") == std::string_view::npos;
    const std::size_t comma = field.find(',');
    if (is_number && comma == std::string_view::npos) has_whole = true;
    if (is_number && comma != std::string_view::npos && comma + 4 == field.size() && field.front() != '0' &&
        !first)
      first = row;
  }
  return has_whole ? first : std::nullopt;
}

std::optional<double> NamedColumns::toNumber(std::string_view field) const {
  return numberIn(field, table_.separator != ',');
}

bool NamedColumns::isText(const std::string& name) const {
  return !isTime(name) &&
         std::ranges::any_of(text(name), [&](const std::string& field) { return !toNumber(field); });
}

bool NamedColumns::isTime(const std::string& name) const {
  bool has_any = false;
  for (const std::string& field : text(name)) {
    if (secondsIn(field))
      has_any = true;
    else if (const auto value = toNumber(field); !value || !std::isnan(*value))
      return false;
  }
  return has_any;
}

}  // namespace toftwin::discover
