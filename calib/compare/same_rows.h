// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/compare/table_columns.h"

namespace toftwin::compare {

/// Whether all rows of one table are, bit for bit, rows of the other, in whatever order, in the columns that are read: a
/// table that is given twice would else look like a perfect twin. Rows that are not finite do not count. A sentence and
/// a space, for the beginning of a verdict; nothing where a row is none of the other's, or there are no two tables.
std::string sameRowsInWords(const std::vector<TableColumns>& tables);

}  // namespace toftwin::compare
