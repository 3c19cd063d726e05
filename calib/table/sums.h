// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "calib/table/column.h"

namespace toftwin::table {

/// Whether a field says that its row sums others up: "Total", "Mittelwert", "écart-type".
bool saysSum(std::string_view field);

/// How many rows at the end of a table are sums, means or the like of those above, by what they are called or by
/// arithmetic: every number of such a row is the same function (sum, mean, median, standard deviation) of its column, as
/// exactly as it is written, and that agreement would come by chance less than once in a million tables.
struct SumRow {
  std::size_t row = 0;
  std::string what{};  ///< "the sum of the rows above"
};
std::vector<SumRow> sumRows(const std::vector<ColumnFields>& columns);

}  // namespace toftwin::table
