// SPDX-License-Identifier: Apache-2.0
#include "calib/table/stamp.h"

#include <charconv>
#include <chrono>
#include <string>
#include <vector>

#include "calib/table/calendar_words.h"
#include "calib/table/number.h"
#include "calib/table/records.h"

namespace toftwin::table {
namespace {

constexpr double kMinute_s = 60.0, kHour_s = 3600.0, kDay_s = 86'400.0;

bool isNumeral(char c) { return c >= '0' && c <= '9'; }
bool isWordPart(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c & '\x80') != 0; }

bool takes(std::string_view& text, std::string_view what) {
  if (!text.starts_with(what)) return false;
  text.remove_prefix(what.size());
  return true;
}

/// Takes a number of `least` to `most` digits off the front.
std::optional<int> takenNumber(std::string_view& text, std::size_t least, std::size_t most) {
  std::size_t digits = 0;
  while (digits < text.size() && isNumeral(text[digits])) ++digits;
  if (digits < least || digits > most) return std::nullopt;
  int value = 0;
  std::from_chars(text.data(), text.data() + digits, value);
  text.remove_prefix(digits);
  return value;
}

/// Takes ".5" or ",5" off the front, in units of the number before it.
double takenFraction(std::string_view& text) {
  if (text.size() < 2 || (text[0] != '.' && text[0] != ',') || !isNumeral(text[1])) return 0.0;
  text.remove_prefix(1);
  std::string digits{"0."};
  for (; !text.empty() && isNumeral(text.front()); text.remove_prefix(1)) digits += text.front();
  double value = 0.0;
  std::from_chars(digits.data(), digits.data() + digits.size(), value);
  return value;
}

std::string_view takenWord(std::string_view& text) {
  std::size_t letters = 0;
  while (letters < text.size() && isWordPart(text[letters])) ++letters;
  const std::string_view word = text.substr(0, letters);
  text.remove_prefix(letters);
  return word;
}

/// Takes "+0200", "+02:00", "+02" off the front, in seconds.
std::optional<double> takenOffset(std::string_view& text) {
  std::string_view rest = text;
  if (rest.empty() || (rest.front() != '+' && rest.front() != '-')) return std::nullopt;
  const double sign = rest.front() == '-' ? -1.0 : 1.0;
  rest.remove_prefix(1);
  const auto hours = takenNumber(rest, 1, 4);
  if (!hours) return std::nullopt;
  const bool is_joined = *hours > 99;
  int minutes = is_joined ? *hours % 100 : 0;
  if (!is_joined && takes(rest, ":")) {
    const auto said = takenNumber(rest, 2, 2);
    if (!said) return std::nullopt;
    minutes = *said;
  }
  const int whole = is_joined ? *hours / 100 : *hours;
  if (whole > 14 || minutes > 59) return std::nullopt;
  text = rest;
  return sign * (kHour_s * whole + kMinute_s * minutes);
}

/// Takes AM, PM, a.m. … off the front; 0, 12 or nothing.
std::optional<int> takenHalf(std::string_view& text) {
  const std::string small = folded(text.substr(0, 5));
  for (const auto& [mark, hours] : {std::pair{"a.m.", 0}, {"p.m.", 12}, {"am", 0}, {"pm", 12}}) {
    if (!small.starts_with(mark)) continue;
    text.remove_prefix(std::string_view{mark}.size());
    return hours;
  }
  return std::nullopt;
}

/// What stands behind hours, minutes and seconds: half of the day, zone; what is left belongs to the date.
bool takeBehind(std::string_view& text, Stamp& stamp) {
  text = trimmed(text);
  if (const auto half = takenHalf(text)) {
    const double hour = stamp.seconds / kHour_s;
    if (hour >= 13.0 || hour < 0.0) return false;
    stamp.seconds += (hour >= 12.0 ? -12.0 : 0.0) * kHour_s + *half * kHour_s;
    text = trimmed(text);
  }
  std::string_view rest = text;
  if (const auto ahead = hoursAhead(takenWord(rest)); ahead && !text.empty()) {
    stamp.is_local = false, stamp.seconds -= kHour_s * *ahead;
    text = rest;
  }
  if (const auto offset = takenOffset(text)) stamp.is_local = false, stamp.seconds -= *offset;
  if (text.starts_with('[') && text.ends_with(']')) text = {};  // the zone's name again
  text = trimmed(text);
  return true;
}

/// Hours, minutes and perhaps seconds off the front.
bool takeClock(std::string_view& text, Stamp& stamp) {
  const auto hours = takenNumber(text, 1, 5);
  if (!hours || !takes(text, ":")) return false;
  const auto minutes = takenNumber(text, 2, 2);
  if (!minutes || *minutes > 59) return false;
  stamp.has_time = true;
  stamp.seconds = kHour_s * *hours + kMinute_s * *minutes;
  if (takes(text, ":")) {
    const auto whole = takenNumber(text, 2, 2);
    if (!whole || *whole > 60) return false;
    const std::string_view before = text;
    stamp.seconds += *whole + takenFraction(text);
    stamp.has_fraction = text.size() < before.size();
    // "10:15:30:250": the thousandths of some loggers.
    if (text.size() == 4 && takes(text, ":"))
      if (const auto thousandths = takenNumber(text, 3, 3)) stamp.seconds += 1e-3 * *thousandths;
    return true;
  }
  stamp.is_pair = true;
  const std::string_view before = text;
  stamp.seconds += kMinute_s * takenFraction(text);
  stamp.has_fraction = text.size() < before.size();
  return true;
}

/// "20260501T101530Z".
bool takeBasic(std::string_view text, Stamp& stamp) {
  const auto date = takenNumber(text, 8, 8);
  if (!date || !(takes(text, "T") || takes(text, " "))) return false;
  const auto clock = takenNumber(text, 6, 6);
  if (!clock) return false;
  stamp.order = DateOrder::YearFirst, stamp.has_time = true;
  stamp.year = *date / 10000, stamp.first = *date / 100 % 100, stamp.second = *date % 100;
  if (*clock / 10000 > 23 || *clock / 100 % 100 > 59 || *clock % 100 > 60) return false;
  stamp.seconds =
      kHour_s * (*clock / 10000) + kMinute_s * (*clock / 100 % 100) + *clock % 100 + takenFraction(text);
  return takeBehind(text, stamp) && text.empty();
}

/// "1h 2m 3.5s", in this order; each once at most.
bool takeDuration(std::string_view text, Stamp& stamp) {
  double before = kDay_s * 2.0;
  while (!text.empty()) {
    const auto whole = takenNumber(text, 1, 6);
    if (!whole) return false;
    const double value = *whole + takenFraction(text);
    text = trimmed(text);
    const std::string unit = folded(takenWord(text));
    const double factor = unit == "d"                    ? kDay_s
                          : unit == "h"                  ? kHour_s
                          : unit == "m" || unit == "min" ? kMinute_s
                          : unit == "s" || unit == "sec" ? 1.0
                                                         : 0.0;
    if (factor == 0.0 || factor >= before) return false;
    before = factor, stamp.seconds += factor * value, stamp.has_time = true;
    text = trimmed(text);
  }
  // "5 s" is a number with its unit.
  return stamp.has_time && before < kDay_s && stamp.seconds >= 0.0;
}

/// The parts of a date, and what stands between its numbers.
struct DateParts {
  std::vector<int> numbers{};
  std::vector<std::size_t> digits{};
  int month = 0;
  char between = '\0';
};

std::optional<DateParts> partsOfDate(std::string_view text) {
  DateParts parts;
  while (!text.empty()) {
    if (isNumeral(text.front())) {
      const std::size_t before = text.size();
      const auto number = takenNumber(text, 1, 4);
      if (!number || parts.numbers.size() == 3) return std::nullopt;
      parts.numbers.push_back(*number), parts.digits.push_back(before - text.size());
    } else if (isWordPart(text.front())) {
      const std::string_view word = takenWord(text);
      const int month = monthOf(word);
      const bool is_first = parts.numbers.empty() && parts.month == 0;
      // "Mar" is a Tuesday in French where a month follows.
      if (month != 0 && parts.month == 0 &&
          !(is_first && isWeekday(word) &&
            text.find_first_not_of(" ,.0123456789") != std::string_view::npos)) {
        parts.month = month;
      } else if (!(is_first && isWeekday(word)) && folded(word) != "de") {
        return std::nullopt;
      }
    } else if (std::string_view{"-./, "}.find(text.front()) != std::string_view::npos) {
      if (parts.numbers.size() == 1 && parts.between == '\0') parts.between = text.front();
      text.remove_prefix(1);
    } else {
      return std::nullopt;
    }
  }
  return parts;
}

int fullYear(int year, std::size_t digits) {
  if (digits != 2) return year;
  return year < 69 ? 2000 + year : 1900 + year;  // as POSIX has it
}

/// Of a date whose month is a word.
bool takeNamedMonth(const DateParts& parts, Stamp& stamp) {
  if (parts.numbers.size() != 2) return false;
  const bool is_year_first = parts.digits[0] == 4;
  const std::size_t year = is_year_first ? 0 : 1;
  stamp.order = DateOrder::YearFirst;
  stamp.year = fullYear(parts.numbers[year], parts.digits[year]);
  stamp.first = parts.month, stamp.second = parts.numbers[1 - year];
  return true;
}

bool takeDate(std::string_view text, Stamp& stamp) {
  const auto parts = partsOfDate(text);
  if (!parts) return false;
  if (parts->month != 0) return takeNamedMonth(*parts, stamp);
  if (parts->numbers.size() != 3 || parts->digits[1] > 2) return false;
  if (parts->digits[0] == 4) {
    stamp.order = DateOrder::YearFirst, stamp.year = parts->numbers[0];
    stamp.first = parts->numbers[1], stamp.second = parts->numbers[2];
    return parts->digits[2] <= 2;
  }
  if (parts->digits[0] > 2 || (parts->digits[2] != 4 && parts->digits[2] != 2)) return false;
  stamp.order = parts->between == '.' ? DateOrder::DayFirst : DateOrder::DayOrMonthFirst;
  stamp.year = fullYear(parts->numbers[2], parts->digits[2]);
  stamp.first = parts->numbers[0], stamp.second = parts->numbers[1];
  return true;
}

/// "0 days", "1 day,": seconds.
std::optional<double> daysBefore(std::string_view text) {
  const auto number = takenNumber(text, 1, 6);
  if (!number) return std::nullopt;
  text = trimmed(text);
  const std::string_view word = takenWord(text);
  if ((word != "day" && word != "days") || !(text.empty() || text == ",")) return std::nullopt;
  return kDay_s * *number;
}

bool isThere(const Stamp& stamp) {
  if (!stamp.hasDate()) return stamp.has_time;
  if (stamp.year < 1900 || stamp.year > 2200) return false;
  return stamp.order == DateOrder::DayOrMonthFirst ? stamp.days(true) || stamp.days(false)
                                                   : stamp.days(false).has_value();
}

}  // namespace

std::optional<double> Stamp::days(bool is_month_first) const {
  const bool is_day_first =
      order == DateOrder::DayFirst || (order == DateOrder::DayOrMonthFirst && !is_month_first);
  const int month = is_day_first ? second : first, day = is_day_first ? first : second;
  if (month < 1 || day < 1) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year{year},
                                         std::chrono::month{static_cast<unsigned>(month)},
                                         std::chrono::day{static_cast<unsigned>(day)}};
  if (!date.ok()) return std::nullopt;
  return static_cast<double>(std::chrono::sys_days{date}.time_since_epoch().count());
}

std::optional<Stamp> stampIn(std::string_view field) {
  constexpr std::size_t kLongest = 60;
  if (field.size() < 4 || field.size() > kLongest) return std::nullopt;
  Stamp stamp;
  const std::size_t colon = field.find(':');
  if (colon == std::string_view::npos) {
    const bool is_read = takeBasic(field, stamp) || (stamp = {}, takeDate(field, stamp)) ||
                         (stamp = {}, takeDuration(field, stamp));
    return is_read && isThere(stamp) ? std::optional{stamp} : std::nullopt;
  }
  std::size_t begin = colon;
  while (begin > 0 && isNumeral(field[begin - 1])) --begin;
  std::string_view before = trimmed(field.substr(0, begin)), clock = field.substr(begin);
  if (!takeClock(clock, stamp)) return std::nullopt;
  if (!before.empty() &&
      (before.back() == 'T' || before.back() == 't' || before.back() == '_' || before.back() == ','))
    before.remove_suffix(1);
  if (const auto days = daysBefore(before)) {
    stamp.seconds += *days, before = {};
  }
  if (!takeBehind(clock, stamp)) return std::nullopt;
  const std::string date =
      clock.empty() ? std::string{before} : std::string{before} + " " + std::string{clock};
  if (!date.empty() && (stamp.seconds > 2 * kDay_s || !takeDate(date, stamp))) return std::nullopt;
  return isThere(stamp) ? std::optional{stamp} : std::nullopt;
}

}  // namespace toftwin::table
