// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace toftwin::table {

/// A line that begins with #, % or //, without that.
struct Comment {
  std::size_t line = 0;
  std::string_view text{};
};

/// A text in fields. All views are into the text that was split, or into `unquoted`.
struct Records {
  std::vector<std::string_view> fields{};  ///< of all records, without blanks around them
  std::vector<std::size_t> begin{0};       ///< of record i: the fields from begin[i] to before begin[i + 1]
  std::vector<std::size_t> line{};         ///< on which a record begins, from 1
  std::vector<std::string_view> text{};    ///< of a record as it was written, its quotes and all
  std::vector<Comment> comments{};
  std::deque<std::string> unquoted{};      ///< fields that held doubled quotes
  std::optional<std::size_t> open_quote{}; ///< the line of a quote that is never closed; splitting ends there

  [[nodiscard]] std::size_t size() const { return line.size(); }
  [[nodiscard]] std::span<const std::string_view> at(std::size_t i) const {
    return std::span{fields}.subspan(begin[i], begin[i + 1] - begin[i]);
  }
};

constexpr char kNoDelimiter = '\0';  ///< one field a record
constexpr char kBlanks = ' ';        ///< any number of blanks and tabs between two fields

/// The text without blanks, tabs, no-break spaces and line ends around it.
std::string_view trimmed(std::string_view text);

/// Splits UTF-8 into records at CR, LF or CR LF, and these at the delimiter. A field in quotes may hold delimiters,
/// line ends and, doubled, quotes; a quote inside a field is a character. Empty lines are left out.
Records splitRecords(std::string_view text, char delimiter, std::size_t first_line = 1,
                     std::size_t most = std::numeric_limits<std::size_t>::max());

}  // namespace toftwin::table
