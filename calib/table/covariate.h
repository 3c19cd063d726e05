// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/table/nature.h"
#include "calib/table/table.h"
#include "calib/table/table_map.h"

namespace toftwin::table {

/// Names in the order they come, and each row's; NaN where a field says nothing.
Column categoryOf(const Table& table, std::size_t column);

/// A column in the unit of its nature: lengths in mm, times in s, angles in degrees. `said`: by the map. `has_group`:
/// whether it names sessions or captures and so is a category whatever it holds. Errors: a text among numbers; a column
/// that is called a time and is none.
Result<Column> covariateOf(const Table& table, std::size_t column, MapNature said, bool is_group,
                           std::vector<std::string>& notes);

}  // namespace toftwin::table
