// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace toftwin::visionary {

/// A point of time as a blob has it: milliseconds in bits 0 to 9, seconds 10 to 15, minutes 16 to 21, hours
/// 22 to 26, the time zone 27 to 37, day 38 to 42, month 43 to 46, year 47 to 58, UTC.
std::uint64_t packedTime(std::int64_t unix_ms);
/// The other way. Numbers that are no date give some time.
std::int64_t unixTime_ms(std::uint64_t packed);

}  // namespace toftwin::visionary
