// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

namespace toftwin::table {

/// The separator that a first line "sep=;" says, and where the text behind it begins.
struct SaidDelimiter {
  char delimiter = ',';
  std::size_t begin = 0;
};
std::optional<SaidDelimiter> saidDelimiter(std::string_view text);

/// The delimiter under which the records at the beginning of the text have the same number of fields, most of
/// which are numbers, and a line that names them: comma, semicolon, tab, bar, blanks or none.
char likeliestDelimiter(std::string_view text);

}  // namespace toftwin::table
