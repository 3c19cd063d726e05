// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

#include "calib/table/look.h"
#include "calib/table/records.h"

namespace toftwin::table {

/// "table.csv:12: has 3 fields …".
Error malformedAt(const std::filesystem::path& name, std::size_t line, std::string_view what);

/// What is looked at to know how a table is laid out.
constexpr std::size_t kSampledRecords = 300;
/// The number of fields that most of the first records have, of those with the most of them.
std::size_t commonWidth(const Records& records);

/// Which records are what.
struct Layout {
  std::vector<std::string> header{};  ///< empty names where no line says any
  std::vector<std::string> units{};   ///< of a line of units; empty where there is none
  std::vector<std::size_t> rows{};    ///< records that are rows of the table
  std::vector<std::string> notes{};
  std::optional<std::size_t> header_line{};  ///< nothing where no line names the columns
};

/// Finds the line that names the columns (a record, or a comment above the numbers), a line of units below
/// it, and the rows; lines above it and texts below the table are left out with a note. Malformed: a row with
/// more or fewer fields than there are names.
Result<Layout> layoutOf(const Records& records, char delimiter, const std::filesystem::path& name);

}  // namespace toftwin::table
