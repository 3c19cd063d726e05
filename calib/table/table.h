// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

#include "calib/table/table_column.h"

/// Text tables as people's tools write them, in columns of numbers, times and names. docs/tables.md says what is read.
namespace toftwin::table {

/// A field or a row that was not used, and why.
struct SetAside {
  std::size_t line = 0;
  std::string column{};  ///< empty: the whole row
  double value = 0.0;
  std::string why{};  ///< "no reading: 999.9 is far from all other values"
};

/// Owns the text that its fields are views of.
class Table {
 public:
  Table() = default;
  Table(Table&&) = default;
  Table& operator=(Table&&) = default;

  std::filesystem::path file{};
  std::vector<TableColumn> columns{};
  std::vector<std::size_t> line{};  ///< of each row, counted from 1
  std::vector<SetAside> aside{};    ///< rows of sums
  std::vector<std::string> notes{};
  bool has_header = false;

  [[nodiscard]] std::size_t rows() const { return line.size(); }
  [[nodiscard]] std::string_view text(std::size_t column, std::size_t row) const {
    return fields_[row * columns.size() + column];
  }
  /// By the header. NotFound: none; Malformed: several.
  [[nodiscard]] Result<std::size_t> find(std::string_view header) const;
  /// Numbers of a column. Malformed, with line and column: a field that is none.
  [[nodiscard]] Result<std::vector<double>> numbers(std::size_t column) const;
  /// "file:12: \"abc\" in column \"depth_mm\" is not a number".
  [[nodiscard]] Error errorAt(std::size_t column, std::size_t row, std::string_view what) const;
  [[nodiscard]] std::vector<std::string> headers() const;
  /// The row of its first field that is neither number nor time; the last, where there is none.
  [[nodiscard]] std::size_t firstTextIn(std::size_t column) const;

 private:
  friend Result<Table> parseTable(std::string_view bytes, const std::filesystem::path& name);
  std::vector<char> text_{};
  std::deque<std::string> unquoted_{};
  std::vector<std::string_view> fields_{};  ///< of all rows, in the text or in unquoted_
};

/// Reads a text table. Errors name file and line: no text, an open quote, a row with more or fewer fields than the
/// header, no rows, over a million rows or 400 columns.
Result<Table> parseTable(std::string_view bytes, const std::filesystem::path& name);
Result<Table> readTable(const std::filesystem::path& file);

/// The numbers of these columns, in the order asked for; NaN where a field says nothing. Errors name
/// file, line and column: a column that is not there or is there twice, a field that is no number.
Result<std::vector<std::vector<double>>> readNumbers(const std::filesystem::path& file,
                                                     std::initializer_list<std::string_view> columns);

}  // namespace toftwin::table
