// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

namespace toftwin::discover {

/// What a field of a table says: a number, NaN where it says that there is none (nothing, nan, NA, n/a, null,
/// none, -,
/// ?) or one that is not finite; nothing where it is a text. `has_decimal_comma`: "1,5" is one and a half, as
/// in tables that are not separated by commas. "1.234,5" is none: see hasThousandsPoint.
std::optional<double> numberIn(std::string_view field, bool has_decimal_comma);

/// 1 or 0, yes or no, true or false; a field that says nothing is false. Nothing where it is anything else.
std::optional<bool> flagIn(std::string_view field);

/// Whether points part the thousands of a number with a decimal comma: "2.596,3".
bool hasThousandsPoint(std::string_view field);

/// Seconds that a time of day (10:15:30.5), a date (2026-05-01, 01.05.2026) or both (2026-05-01T10:15:30Z,
/// ISO 8601; 01.05.2026 10:15) mean, since midnight or since 1970; nothing where it is none.
std::optional<double> secondsIn(std::string_view field);

}  // namespace toftwin::discover
