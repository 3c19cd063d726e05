// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/table/roles.h"
#include "calib/table/table.h"

namespace toftwin::table {

/// Finds the column that says what should have been measured, by words and by what the rows do: it is followed by the
/// measured values at a gain of 0.2 to 5 that is no ratio of units. What a header calls the reference is checked so,
/// too. Errors ask: two columns could be it; measured values do not follow what is called so; the two are in other units
/// than their headers say.
Result<> findReference(const Table& table, const TableMap& map, Roles& roles, std::vector<std::string>& notes);

/// What a column's values are multiplied with to be in mm, where its header says a unit of length; 0 where it says none.
double millimetresIn(const TableColumn& column);

}  // namespace toftwin::table
