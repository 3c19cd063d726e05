// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "calib/discover/table_source.h"

namespace toftwin::discover {

/// Captures that follow each other, or rows, of which all are off by about the same.
struct OddRows {
  std::size_t first_line = 0, last_line = 0;
  std::size_t captures = 0;  ///< 0: rows of which no column says that they are captures
  double size = 0.0;         ///< in the error's unit, beside the others
};

/// Captures whose medians are more than five robust deviations of all captures' medians, and of what noise makes of
/// one, from the others'. Where no captures are known, groups of rows that follow each other. `left`: of the source's
/// rows, with all effects known; a capture's own offset is in it. Few captures, whose offsets are nuisances, are none.
std::vector<OddRows> oddCaptures(const TableSource& source, const std::vector<double>& left);

/// "lines 302 to 346 (3 captures, +14.0 mm)"
std::string inWords(const std::vector<OddRows>& odd, const std::string& unit);

}  // namespace toftwin::discover
