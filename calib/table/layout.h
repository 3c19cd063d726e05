// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

#include "calib/table/records.h"

namespace toftwin::table {

/// "table.csv:12: has 3 fields …".
Error malformedAt(const std::filesystem::path& name, std::size_t line, std::string_view what);

/// What one field looks like, before it is known what its column holds.
enum class Look { Nothing, Number, Time, Text };
Look lookOf(std::string_view field);

/// The separator that a first line "sep=;" says, and where the text behind it begins.
struct SaidDelimiter {
  char delimiter = ',';
  std::size_t begin = 0;
};
std::optional<SaidDelimiter> saidDelimiter(std::string_view text);

/// The delimiter under which the records at the beginning of the text have the same number of fields, most of which are
/// numbers, and a line that names them: comma, semicolon, tab, bar, blanks or none.
char likeliestDelimiter(std::string_view text);

/// Which records are what.
struct Layout {
  std::vector<std::string> header{};       ///< empty names where no line says any
  std::vector<std::string> units{};        ///< of a line of units; empty where there is none
  std::vector<std::size_t> rows{};         ///< records that are rows of the table
  std::vector<std::string> notes{};
  std::optional<std::size_t> header_line{};  ///< nothing where no line names the columns
};

/// Finds the line that names the columns (a record, or a comment above the numbers), a line of units below it, and the
/// rows; lines above it and texts below the table are left out with a note. Malformed: a row with more or fewer fields
/// than there are names.
Result<Layout> layoutOf(const Records& records, char delimiter, const std::filesystem::path& name);

}  // namespace toftwin::table
