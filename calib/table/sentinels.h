// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "calib/table/table.h"

namespace toftwin::table {

/// Values of one column that stand for "no reading", as rows: those that are isolated, that is, farther from all other
/// values than a multiple of what these spread over. The multiple is
///   1 for a code that instruments write (85, −127, 999.9, 9999, 65535, …, −1),
///   3 for a value of few rows (3 % at most, or one),
///  20 for a value that many rows repeat exactly, up to half of them, and for 0, which may be a true nothing.
/// No value is taken from a column with fewer than eight other values, as settings have, unless it is a code and 3 times
/// as far; and none that only goes on where a sorted column ends.
std::vector<std::size_t> isolatedRows(const std::vector<double>& values, bool is_time);

/// Whether it is a code that instruments write for "no reading".
bool isCode(double value);

/// Sets such values of all columns of numbers to NaN, and says which. A value that is no code stays where another column
/// is isolated in the same row: then something happened there.
std::vector<SetAside> setSentinelsAside(Table& table);

}  // namespace toftwin::table
