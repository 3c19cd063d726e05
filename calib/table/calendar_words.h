// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

namespace toftwin::table {

/// A month's number, by the letters that no other month of the five languages begins with; 0: it is none.
int monthOf(std::string_view word);

bool isWeekday(std::string_view word);

/// How far a zone that is a word is ahead of UTC, in hours: "CEST" → 2.
std::optional<double> hoursAhead(std::string_view word);

}  // namespace toftwin::table
