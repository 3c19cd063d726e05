// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/same_rows.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

#include "protocol/types/counted.h"

namespace toftwin::compare {
namespace {

using SortedRows = std::vector<std::vector<double>>;

SortedRows sortedRowsOf(const TableColumns& table) {
  SortedRows rows;
  for (std::size_t i = 0; i < table.values.front().size(); ++i) {
    std::vector<double> row;
    for (const auto& column : table.values) row.push_back(column[i]);
    if (std::ranges::all_of(row, [](double one) { return std::isfinite(one); })) rows.push_back(std::move(row));
  }
  std::ranges::sort(rows);
  return rows;
}

}  // namespace

std::string sameRowsInWords(const std::vector<TableColumns>& tables) {
  if (tables.size() < 2 || tables[0].kind != tables[1].kind) return {};
  const SortedRows a = sortedRowsOf(tables[0]), b = sortedRowsOf(tables[1]);
  const bool is_b_longer = b.size() > a.size();
  const auto &longer = is_b_longer ? b : a, &shorter = is_b_longer ? a : b;
  if (shorter.empty() || !std::ranges::includes(longer, shorter)) return {};
  const std::string same =
      a.size() == b.size()
          ? fmt::format("A and B have the same {}", counted(a.size(), "row"))
          : fmt::format("Each of {}'s {} is one of {}'s {}", is_b_longer ? "A" : "B", counted(shorter.size(), "row"),
                        is_b_longer ? "B" : "A", longer.size());
  return same + ": one table may be given twice, or a copy of it; B − A says nothing then. ";
}

}  // namespace toftwin::compare
