// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace toftwin::table {

/// Which of a date's numbers is what, where the year stands at its end.
enum class DateOrder : std::uint8_t { None, YearFirst, DayFirst, MonthFirst, DayOrMonthFirst };

/// A date, a time of day or a duration as it is written.
struct Stamp {
  DateOrder order = DateOrder::None;
  int year = 0, first = 0, second = 0;  ///< first: the day of DayFirst, else the month, or what stands first
  double seconds = 0.0;                 ///< of the day, or since a start; of a pair a:b in hours and minutes
  bool has_time = false;
  bool is_pair = false;       ///< "10:15": hours and minutes or minutes and seconds
  bool has_fraction = false;  ///< of its last number
  bool is_local = true;       ///< no zone is said

  [[nodiscard]] bool hasDate() const { return order != DateOrder::None; }
  /// Days since 1970 if the day or the month stands first; nothing where there is no such day.
  [[nodiscard]] std::optional<double> days(bool is_month_first) const;
};

/// Reads ISO 8601 with any zone, dates with points, slashes or dashes, months as words in five languages, AM and PM,
/// h:mm:ss, "0 days 00:00:10" and "1h 2m 3s". A zone is taken off `seconds`. Nothing where it is none of these.
std::optional<Stamp> stampIn(std::string_view field);

}  // namespace toftwin::table
