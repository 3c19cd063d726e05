// SPDX-License-Identifier: Apache-2.0
#include "drivers/visionary/wire/timestamp.h"

#include <chrono>

namespace toftwin::visionary {
namespace {

using namespace std::chrono;

constexpr unsigned kSecond = 10, kMinute = 16, kHour = 22, kDay = 38, kMonth = 43, kYear = 47;

std::uint64_t part(std::int64_t number, unsigned shift) {
  return static_cast<std::uint64_t>(number) << shift;
}
unsigned bits(std::uint64_t packed, unsigned shift, unsigned count) {
  return static_cast<unsigned>(packed >> shift & ((std::uint64_t{1} << count) - 1));
}

}  // namespace

std::uint64_t packedTime(std::int64_t unix_ms) {
  const sys_time<milliseconds> at{milliseconds{unix_ms}};
  const auto day = floor<days>(at);
  const year_month_day date{day};
  const hh_mm_ss time{at - day};
  return part(time.subseconds().count(), 0) | part(time.seconds().count(), kSecond) |
         part(time.minutes().count(), kMinute) | part(time.hours().count(), kHour) |
         part(static_cast<unsigned>(date.day()), kDay) | part(static_cast<unsigned>(date.month()), kMonth) |
         part(static_cast<int>(date.year()), kYear);
}

std::int64_t unixTime_ms(std::uint64_t packed) {
  const year_month_day date{year{static_cast<int>(bits(packed, kYear, 12))}, month{bits(packed, kMonth, 4)},
                            day{bits(packed, kDay, 5)}};
  const sys_days days_since = date.ok() ? sys_days{date} : sys_days{};
  const auto since = hours{bits(packed, kHour, 5)} + minutes{bits(packed, kMinute, 6)} +
                     seconds{bits(packed, kSecond, 6)} + milliseconds{bits(packed, 0, 10)};
  return duration_cast<milliseconds>(days_since.time_since_epoch() + since).count();
}

}  // namespace toftwin::visionary
