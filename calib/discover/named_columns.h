// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

#include "calib/discover/csv_table.h"

namespace toftwin::discover {

/// Reads columns of a CsvTable by their headers; errors name file and line. Both stay the caller's.
class NamedColumns {
 public:
  NamedColumns(const CsvTable& table, const std::filesystem::path& file) : table_(table), file_(file) {}

  [[nodiscard]] std::optional<std::size_t> find(const std::string& name) const;
  [[nodiscard]] Error missing(const std::string& name) const;
  /// Of a column that is there.
  [[nodiscard]] const std::vector<std::string>& text(const std::string& name) const {
    return table_.columns[*find(name)];
  }
  /// NaN where a field says that there is none. Times become seconds since the first of them.
  [[nodiscard]] Result<std::vector<double>> numbers(const std::string& name) const;
  /// Times are seconds since 1970, or since midnight.
  [[nodiscard]] Result<std::vector<double>> asWritten(const std::string& name) const;
  /// 1 and 0, yes and no, true and false; a field that says nothing is false.
  [[nodiscard]] Result<std::vector<bool>> flags(const std::string& name) const;
  static double firstOf(const std::vector<double>& values);
  [[nodiscard]] bool isText(const std::string& name) const;
  /// Times of day or dates, but for fields that say nothing.
  [[nodiscard]] bool isTime(const std::string& name) const;

 private:
  [[nodiscard]] Error notIn(std::size_t column, std::size_t row, std::string_view what) const;
  [[nodiscard]] std::string_view adviceFor(std::size_t column, std::size_t row) const;
  /// The first row may be a second line of headers.
  [[nodiscard]] bool beginsWithTexts() const;
  [[nodiscard]] std::optional<double> toNumber(std::string_view field) const;
  /// The first "1,020" in a column with "950", where commas may be those of decimals: none is guessed.
  [[nodiscard]] std::optional<std::size_t> thousandOrNot(std::size_t column) const;

  const CsvTable& table_;
  const std::filesystem::path& file_;
};

}  // namespace toftwin::discover
