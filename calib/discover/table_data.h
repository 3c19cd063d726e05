// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/discover/csv_table.h"
#include "calib/discover/table_map.h"

namespace toftwin::discover {

/// One covariate of a table.
struct TableCovariate {
  std::string name{};
  Nature nature = Nature::Plain;
  std::vector<double> values{};
  std::vector<std::string> words{};  ///< of a category: what the values 0, 1, … stand for
  /// Of a column of dates or times of day: its first, from which the values count; seconds since 1970 or
  /// since midnight.
  std::optional<double> first{};
};

/// Numbers of a table, rows in the file's order.
struct TableData {
  std::filesystem::path file{};
  std::string unit{};               ///< of the error, from a header's end: "mm"; may be empty
  std::vector<double> error{};      ///< measured − reference
  std::vector<double> reference{};  ///< empty if there is none
  std::string reference_name{};
  std::vector<double> sigma{};  ///< empty if not given
  std::vector<int> session{};   ///< number of each row's session
  std::vector<std::string> session_names{};
  bool sessions_are_captures = false;  ///< see giveFewCapturesOffsets()
  std::vector<int> capture{};  ///< numbers; empty if no column names them
  std::vector<bool> locked{};
  std::vector<TableCovariate> covariates{};
  std::vector<std::size_t> line{};
  double period = 0.0;  ///< c/(2f) in the reference's unit; 0: not known
  bool has_locked_column = false;
  /// What was understood, left out or is doubtful, for the report: what the data can and cannot show.
  std::vector<std::string> notes{}, doubts{};
  [[nodiscard]] std::size_t rows() const { return error.size(); }
};

/// By the map, and where it is silent by the headers. Errors: a column that is not there; a number that is
/// none; neither measured values nor errors; fewer than 20 usable rows; nothing that the error could go with.
Result<TableData> readTable(const CsvTable& table, const TableMap& map, const std::filesystem::path& file);

/// Marks rows to be locked: the column's, else whole sessions where there are five, else one of every few
/// blocks of rows that follow each other.
void lock(TableData& data, const TableMap& map);

/// The rows for which `wanted` is true; their notes too.
TableData rowsOf(const TableData& data, const std::vector<bool>& wanted);

/// SHA-256 over the numbers of these rows, 64 hex digits.
std::string hashOf(const TableData& data);

}  // namespace toftwin::discover
