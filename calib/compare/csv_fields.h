// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace toftwin::compare {

/// The text without blanks, tabs and line ends around it.
std::string trimmed(std::string_view text);

/// Fields of a line of a text table, trimmed; what is quoted may hold the separator. Nothing where a quote is never
/// closed.
std::optional<std::vector<std::string>> csvFields(std::string_view line, char separator);
inline constexpr std::string_view kOpenQuote = "a quote is opened and not closed on the same line";

/// That a row has more or fewer fields than the header, and what more may come from: such a row is refused, as nobody
/// knows which of its fields are whose.
std::string otherFieldCount(std::size_t fields, std::size_t header, char separator);

}  // namespace toftwin::compare
