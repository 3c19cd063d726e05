// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/table_field.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <chrono>
#include <cmath>
#include <string>

namespace toftwin::discover {
namespace {

/// Whether it is one of these words, in small letters or not.
template <std::size_t N>
bool isOneOf(std::string_view field, const std::array<const char*, N>& words) {
  std::string lower{field};
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::ranges::find(words, lower) != words.end();
}

bool saysNothing(std::string_view field) {
  return isOneOf(field, std::array{"", "nan", "na", "n/a", "null", "none", "-", "--", "?"});
}

/// Takes a number off the front, of so many digits.
std::optional<int> taken(std::string_view& text, std::size_t digits) {
  int value = 0;
  if (text.size() < digits) return std::nullopt;
  const auto [end, error] = std::from_chars(text.data(), text.data() + digits, value);
  if (error != std::errc{} || end != text.data() + digits || value < 0) return std::nullopt;
  text.remove_prefix(digits);
  return value;
}
bool takes(std::string_view& text, char c) {
  if (text.empty() || text.front() != c) return false;
  text.remove_prefix(1);
  return true;
}

/// "10:15:30.5", the rest stays.
std::optional<double> timeOfDay(std::string_view& text) {
  const auto hours = taken(text, 2);
  if (!hours || *hours > 23 || !takes(text, ':')) return std::nullopt;
  const auto minutes = taken(text, 2);
  if (!minutes || *minutes > 59) return std::nullopt;
  double seconds = 60.0 * (60.0 * *hours + *minutes);
  if (!takes(text, ':')) return seconds;
  const auto whole = taken(text, 2);
  if (!whole || *whole > 60) return std::nullopt;
  seconds += *whole;
  if (!text.empty() && (text.front() == '.' || text.front() == ',')) {
    text.remove_prefix(1);
    double place = 0.1;
    for (; !text.empty() && text.front() >= '0' && text.front() <= '9'; text.remove_prefix(1), place *= 0.1)
      seconds += place * (text.front() - '0');
  }
  return seconds;
}

std::optional<double> daysSince1970(int year, int month, int day) {
  const std::chrono::year_month_day date{std::chrono::year{year},
                                         std::chrono::month{static_cast<unsigned>(month)},
                                         std::chrono::day{static_cast<unsigned>(day)}};
  if (!date.ok()) return std::nullopt;
  return static_cast<double>(std::chrono::sys_days{date}.time_since_epoch().count());
}

/// "2026-05-01" or "01.05.2026", in days since 1970.
std::optional<double> dayOf(std::string_view& text) {
  const bool is_german = text.size() > 2 && text[2] == '.';
  const char between = is_german ? '.' : '-';
  const auto first = taken(text, is_german ? 2 : 4);
  if (!first || !takes(text, between)) return std::nullopt;
  const auto month = taken(text, 2);
  if (!month || !takes(text, between)) return std::nullopt;
  const auto last = taken(text, is_german ? 4 : 2);
  if (!last) return std::nullopt;
  return is_german ? daysSince1970(*last, *month, *first) : daysSince1970(*first, *month, *last);
}

/// "Z", "+02:00" or nothing: by how much local time is ahead.
std::optional<double> aheadOf(std::string_view text) {
  if (text.empty() || text == "Z") return 0.0;
  const double sign = text.front() == '-' ? -1.0 : 1.0;
  if (text.front() != '+' && text.front() != '-') return std::nullopt;
  text.remove_prefix(1);
  const auto ahead = timeOfDay(text);
  return ahead && text.empty() ? std::optional{sign * *ahead} : std::nullopt;
}

}  // namespace

std::optional<double> numberIn(std::string_view field, bool has_decimal_comma) {
  if (saysNothing(field)) return std::nan("");
  if (field.front() == '+') field.remove_prefix(1);
  std::string text{field};
  if (has_decimal_comma && std::ranges::count(text, ',') == 1 && text.find('.') == std::string::npos)
    std::ranges::replace(text, ',', '.');
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  // Squares of what is larger overflow before anything can be said about it.
  return std::isfinite(value) && std::abs(value) < 1e100 ? value : std::nan("");
}

std::optional<bool> flagIn(std::string_view field) {
  if (isOneOf(field, std::array{"yes", "y", "true", "ja", "wahr"})) return true;
  if (saysNothing(field) || isOneOf(field, std::array{"no", "n", "false", "nein", "falsch"})) return false;
  const auto number = numberIn(field, true);
  if (number == 1.0) return true;
  return number == 0.0 ? std::optional{false} : std::nullopt;
}

bool hasThousandsPoint(std::string_view field) {
  const std::size_t comma = field.find(','), first = field.find('.');
  if (comma == std::string_view::npos || first == std::string_view::npos || comma < first) return false;
  if (field.front() == '-' || field.front() == '+') field.remove_prefix(1);
  return field.find_first_not_of("0123456789.,") == std::string_view::npos && field.find(',') > 3 &&
         field[field.find(',') - 4] == '.';
}

std::optional<double> secondsIn(std::string_view field) {
  constexpr double kDay = 86'400.0;
  double days = 0.0;
  const bool has_date = field.size() >= 10 && (field[4] == '-' || (field[2] == '.' && field[5] == '.'));
  if (has_date) {
    const auto day = dayOf(field);
    if (!day) return std::nullopt;
    if (field.empty()) return *day * kDay;
    if (!takes(field, 'T') && !takes(field, ' ')) return std::nullopt;
    days = *day;
  }
  const auto seconds = timeOfDay(field);
  if (!seconds) return std::nullopt;
  const auto ahead = has_date ? aheadOf(field) : field.empty() ? std::optional{0.0} : std::nullopt;
  if (!ahead) return std::nullopt;
  return days * kDay + *seconds - *ahead;
}

}  // namespace toftwin::discover
