// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace toftwin::table {

/// A column of dates or times of day.
struct Times {
  std::vector<double> seconds{};  ///< since 1970 (UTC, or local where no zone is said), or since midnight; NaN: none
  bool has_dates = false;
  std::string note{};  ///< what was guessed: "dates are read with the month first"
};

/// Reads all fields in one way: which of day and month stands first is known from all of them, and times of day that
/// fall by more than half a day are those of the next one. Nothing where a field is no time, or hours and minutes cannot
/// be told from minutes and seconds.
std::optional<Times> timesIn(const std::vector<std::string_view>& fields);

/// What a time's numbers count, where they can only be read as a point in time.
struct Epoch {
  double seconds_per_unit = 1.0;
  double offset_s = 0.0;  ///< since 1970, of 0 in the file
  std::string name{};     ///< "seconds since 1970", "days of a spreadsheet"
};
/// Seconds, milli-, micro- or nanoseconds since 1970 between 1990 and 2100, or, where `may_be_days`, a spreadsheet's
/// days between 2000 and 2050. Nothing where they are plain numbers.
std::optional<Epoch> epochOf(const std::vector<double>& values, bool may_be_days);

}  // namespace toftwin::table
