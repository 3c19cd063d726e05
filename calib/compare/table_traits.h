// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <toftwin/result.h>

#include "calib/compare/named_traits.h"
#include "calib/compare/table_columns.h"

/// Characteristics of tables: measured scan lines and series, published ones too, through the same code as a
/// run's frames.
namespace toftwin::compare {

/// What a table's rows tell, said to be `of` this camera.
void addTraits(const TableColumns& table, const std::vector<double>& frequency_hz, const char* of,
               TraitCollector& all);

/// One table, or two of which the second is held against the first: a page with verdict, numbers and plot.
Result<Report> judgeTables(const std::vector<TableJob>& jobs);

}  // namespace toftwin::compare
