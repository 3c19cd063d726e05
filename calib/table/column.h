// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "calib/table/table.h"

namespace toftwin::table {

using ColumnFields = std::vector<std::string_view>;

/// Which decimal signs a table's columns use for certain.
struct DecimalEvidence {
  bool has_point = false, has_comma = false;
};

/// What certain fields of one column say. A column of texts says nothing.
DecimalEvidence evidenceIn(const ColumnFields& fields);

/// Fills kind, values, sign, note and odd field. `others`: what all columns say; `delimiter`: the table's.
void readColumn(const ColumnFields& fields, const DecimalEvidence& others, char delimiter, TableColumn& column);

}  // namespace toftwin::table
