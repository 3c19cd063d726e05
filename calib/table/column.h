// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string_view>
#include <vector>

#include "calib/table/number.h"
#include "calib/table/table_column.h"

namespace toftwin::table {

using ColumnFields = std::vector<std::string_view>;

/// Which decimal signs a table's columns use for certain.
struct DecimalEvidence {
  bool has_point = false, has_comma = false;
};

/// How many fields of a column use which signs.
struct SignCounts {
  std::array<std::size_t, 7> count{};  ///< by Signs
  std::size_t nothing = 0, rows = 0;
  [[nodiscard]] std::size_t of(Signs signs) const { return count[static_cast<std::size_t>(signs)]; }
  [[nodiscard]] std::size_t point() const { return of(Signs::Point) + of(Signs::GroupsOfComma); }
  [[nodiscard]] std::size_t comma() const { return of(Signs::Comma) + of(Signs::GroupsOfPoint); }
  [[nodiscard]] std::size_t numbers() const { return rows - nothing - of(Signs::NoNumber); }
};
SignCounts signCounts(const ColumnFields& fields);

/// What certain fields of one column say. A column of texts says nothing.
DecimalEvidence evidenceIn(const SignCounts& counts);

/// Fills kind, values, sign, note and odd field. `others`: what all columns say; `delimiter`: the table's.
void readColumn(const ColumnFields& fields, const SignCounts& counts, const DecimalEvidence& others,
                char delimiter, TableColumn& column);

}  // namespace toftwin::table
