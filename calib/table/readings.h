// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

#include "calib/table/nature.h"
#include "calib/table/table.h"
#include "calib/table/table_map.h"

/// What a person's table says, column by column, and which column is what.
namespace toftwin::table {

/// The rows of a table with their roles. All vectors have one entry a row, rows in the file's order.
struct Readings {
  std::filesystem::path file{};
  std::string unit{};               ///< of measured, reference and error: "mm" for every length; else the header's own; may be empty
  std::string measured_name{}, reference_name{}, error_name{};  ///< headers; empty where there is none
  AsWritten measured_written{}, reference_written{}, error_written{};
  std::vector<double> measured{};   ///< empty where the file gives the error alone; NaN: no reading
  std::vector<double> reference{};  ///< empty where there is none
  std::vector<double> error{};      ///< measured − reference, or as the file gives it; measured alone where there is no reference
  std::vector<double> sigma{};      ///< empty where not given
  std::vector<Column> covariates{};  ///< what the error may go with, without reference and measured values
  std::string session_name{}, capture_name{};  ///< headers of covariates (categories) that name sessions, captures; may be empty
  std::vector<bool> locked{};       ///< rows only for judging; empty where no column says so
  std::vector<std::size_t> line{};  ///< of the file, counted from 1
  double modulation_mhz = 0.0;      ///< 0: not known
  std::vector<SetAside> aside{};
  std::vector<std::string> notes{};  ///< how it was read, and what was guessed
  [[nodiscard]] std::size_t rows() const { return error.size(); }
};

/// Reads a table by the map, and where it is silent by headers and rows (docs/tables.md). Errors name the file and, of a
/// field, its line and column: what readTable() and rolesOf() refuse, a text among numbers, a column that is called a
/// time and cannot be read as one, two columns that could have the same role.
Result<Readings> readReadings(const std::filesystem::path& file, const TableMap& map);
/// The same of a text; `name` stands for the file.
Result<Readings> parseReadings(std::string_view bytes, const TableMap& map, const std::filesystem::path& name);

}  // namespace toftwin::table
