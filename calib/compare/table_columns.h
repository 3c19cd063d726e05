// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/result.h>

/// Kinds of tables of which characteristics are told, and their columns as files have them.
namespace toftwin::compare {

/// What of a table is a characteristic, by name: "drift".
struct TableKind {
  const char* name;
  const char* tells;                 ///< "warm-up drift and its model"
  std::vector<const char*> columns;  ///< with their units: "time_s", "value_mm"
  bool needs_frequency = false;
  bool shares_places = false;  ///< readings of one value of the first column count together; so do a session's
};
const std::vector<TableKind>& tableKinds();
/// Null if there is none of that name.
const TableKind* findTableKind(const std::string& name);

struct TableJob {
  std::filesystem::path file;  ///< CSV with a header
  std::string kind{};
  /// The file's names of the kind's columns, in their order; empty: the kind's own. "-" before a name changes
  /// the sign; a name that ends in another unit of the same quantity ("_mm", "[mm]" for "_m") is converted;
  /// "=mm" behind it says the unit.
  std::vector<std::string> columns{};
  std::vector<double> frequency_hz{};  ///< of modulation, where the kind needs it
};

/// The columns of a table in the kind's units.
struct TableColumns {
  const TableKind* kind = nullptr;
  std::vector<std::vector<double>> values{};
  std::vector<double> session{};     ///< each row's, where the file has such a column and the kind heeds it
  std::vector<std::string> notes{};  ///< what was taken for granted, and what is odd about the rows
};
/// Errors: an unknown kind, a column that the file lacks or whose unit is unknown or of another quantity, no
/// frequency.
Result<TableColumns> loadTable(const TableJob& job);
/// The same without some of the rows of which all values are finite, counted from 0.
TableColumns withoutRows(TableColumns table, const std::vector<std::size_t>& rows);

}  // namespace toftwin::compare
