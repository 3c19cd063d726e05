// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "calib/table/table.h"

namespace toftwin::table {

/// What a column is, as far as it decides what may be isolated in it.
enum class Screened {
  Covariate,
  Time,     ///< a pause makes what comes after it isolated
  Reading,  ///< measured values and errors, of which some are grossly wrong: that is for who knows the others
};

/// Values of one column that stand for "no reading", as rows: those that are isolated, that is, farther from
/// all other values than a multiple of what these spread over. The multiple is
///   1 for a code that instruments write (85, −127, 999.9, 9999, 65535, …, −1),
///   5 for a value of few rows of a covariate (3 % at most, or one),
///  20 for a value that many rows repeat exactly, up to half of them, and for 0, which may be a true nothing.
/// No value is taken from a column with fewer than eight other values, as settings have, unless it is a code
/// and 3 times as far; and none that only goes on where a sorted column ends.
std::vector<std::size_t> isolatedRows(const std::vector<double>& values, Screened as);

/// Whether it is a code that instruments write for "no reading".
bool isCode(double value);

/// Sets such values to NaN in columns of numbers, and says which. `columns`: those that are screened;
/// `readings`: those of measured values and errors. A value that is no code stays where another column is
/// isolated in the same row: then something happened there.
std::vector<SetAside> setSentinelsAside(Table& table, const std::set<std::size_t>& columns,
                                        const std::set<std::size_t>& readings);

/// What was set aside, a sentence for each value of a column: "column temperature_c: no reading: 999.9 is far from all
/// other values (line 102)".
std::vector<std::string> inWords(const std::vector<SetAside>& aside);

}  // namespace toftwin::table
