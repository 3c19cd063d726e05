// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::discover {

/// A text table as it stands in the file.
struct CsvTable {
  char separator = ',';
  std::vector<std::string> header{};
  std::vector<std::vector<std::string>> columns{};  ///< of text, without blanks around it
  std::vector<std::size_t> line{};                  ///< of the file, for each row
  bool is_from_windows = false;                     ///< it was no UTF-8 and is read as Windows-1252
  [[nodiscard]] std::size_t rows() const { return line.size(); }
};

/// A header line and rows, separated by commas, semicolons or tabs (whichever the header has most of); fields
/// may be quoted, lines that begin with # and empty lines are left out; a first line `sep=;` says which.
/// Bytes that are no UTF-8 are read as Windows-1252, Latin-1 among it. Errors name file and line: a row with
/// more or fewer fields than the header, a header twice or of one column, an open quote, no rows, over a
/// million rows or 400 columns.
Result<CsvTable> parseCsv(std::string_view text, const std::filesystem::path& name);
Result<CsvTable> loadCsv(const std::filesystem::path& file);

}  // namespace toftwin::discover
