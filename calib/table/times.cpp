// SPDX-License-Identifier: Apache-2.0
#include "calib/table/times.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/table/number.h"
#include "calib/table/stamp.h"

namespace toftwin::table {
namespace {

constexpr double kSecondsOfDay = 86'400.0;

using Stamps = std::vector<std::optional<Stamp>>;

/// Nothing where a field is no time, or only some are dates.
std::optional<Stamps> stampsOf(const std::vector<std::string_view>& fields) {
  Stamps stamps;
  std::optional<bool> has_date;
  for (const std::string_view field : fields) {
    if (saysNothing(field)) {
      stamps.emplace_back();
      continue;
    }
    const auto stamp = stampIn(field);
    if (!stamp || has_date.value_or(stamp->hasDate()) != stamp->hasDate()) return std::nullopt;
    has_date = stamp->hasDate();
    stamps.push_back(stamp);
  }
  return has_date ? std::optional{std::move(stamps)} : std::nullopt;
}

/// First to last day of all dates that are read so; infinite where one of them is no day.
double spanOf(const Stamps& stamps, bool is_month_first) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const auto& stamp : stamps) {
    if (!stamp) continue;
    const auto days = stamp->days(is_month_first);
    if (!days) return std::numeric_limits<double>::infinity();
    low = std::min(low, *days), high = std::max(high, *days);
  }
  return high - low;
}

/// Nothing where neither order makes all of them days.
std::optional<Times> withDates(const Stamps& stamps) {
  const double month_first = spanOf(stamps, true), day_first = spanOf(stamps, false);
  if (!std::isfinite(std::min(month_first, day_first))) return std::nullopt;
  Times times{.has_dates = true};
  const bool is_month_first = month_first <= day_first;
  const bool is_open = std::ranges::any_of(
      stamps, [](const auto& one) { return one && one->order == DateOrder::DayOrMonthFirst; });
  if (is_open)
    times.note =
        is_month_first ? "its dates are read with the month first" : "its dates are read with the day first";
  for (const auto& stamp : stamps)
    times.seconds.push_back(stamp ? kSecondsOfDay * *stamp->days(is_month_first) + stamp->seconds
                                  : std::nan(""));
  return times;
}

/// Times of day that fall by more than half a day are those of the next one.
void goOverMidnight(std::vector<double>& seconds) {
  double days = 0.0, before = std::nan("");
  for (double& value : seconds) {
    if (std::isnan(value)) continue;
    if (value < before - 0.5 * kSecondsOfDay) days += kSecondsOfDay;
    before = value;
    value += days;
  }
}

/// Nothing where pairs may be hours and minutes as well as minutes and seconds.
std::optional<Times> withoutDates(const Stamps& stamps) {
  bool has_pair = false, has_whole = false, has_fraction = false, is_beyond_day = false;
  for (const auto& stamp : stamps) {
    if (!stamp) continue;
    (stamp->is_pair ? has_pair : has_whole) = true;
    has_fraction = has_fraction || (stamp->is_pair && stamp->has_fraction);
    is_beyond_day = is_beyond_day || stamp->seconds >= kSecondsOfDay;
  }
  const bool are_minutes = has_pair && (has_whole || has_fraction);
  if (has_pair && !are_minutes && is_beyond_day) return std::nullopt;
  Times times;
  for (const auto& stamp : stamps)
    times.seconds.push_back(!stamp                          ? std::nan("")
                            : stamp->is_pair && are_minutes ? stamp->seconds / 60.0
                                                            : stamp->seconds);
  if (are_minutes) times.note = "its times are read as minutes and seconds";
  if (!is_beyond_day && !are_minutes) goOverMidnight(times.seconds);
  return times;
}

}  // namespace

std::optional<Times> timesIn(const std::vector<std::string_view>& fields) {
  const auto stamps = stampsOf(fields);
  if (!stamps) return std::nullopt;
  const bool has_dates = std::ranges::any_of(*stamps, [](const auto& one) { return one && one->hasDate(); });
  return has_dates ? withDates(*stamps) : withoutDates(*stamps);
}

std::optional<Epoch> epochOf(const std::vector<double>& values, bool may_be_days) {
  constexpr double k1990_s = 631'152'000.0, k2100_s = 4'102'444'800.0;
  constexpr double k2000_days = 36'526.0, k2050_days = 54'789.0,
                   kDaysTo1970 = 25'569.0;  // Excel's day 0: 1899-12-30
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double value : values)
    if (std::isfinite(value)) low = std::min(low, value), high = std::max(high, value);
  if (!(high >= low)) return std::nullopt;
  for (const auto& [seconds, name] :
       {std::pair{1.0, "seconds"}, {1e-3, "milliseconds"}, {1e-6, "microseconds"}, {1e-9, "nanoseconds"}})
    if (low * seconds > k1990_s && high * seconds < k2100_s)
      return Epoch{.seconds_per_unit = seconds, .name = std::string{name} + " since 1970"};
  if (may_be_days && low > k2000_days && high < k2050_days && high - low < 3'660.0) {
    return Epoch{.seconds_per_unit = kSecondsOfDay,
                 .offset_s = -kDaysTo1970 * kSecondsOfDay,
                 .name = "a spreadsheet's days"};
  }
  return std::nullopt;
}

}  // namespace toftwin::table
