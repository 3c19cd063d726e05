// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace toftwin::table {

enum class Kind : std::uint8_t { Number, Time, Text };

/// A field that is none of what its column holds.
struct OddField {
  std::size_t row = 0;
  std::string why{};  ///< "is not a number: leave the field empty where there is none"
};

struct TableColumn {
  std::string header{};  ///< empty where no line names it
  std::string stem{};    ///< the header without its unit
  std::string unit{};    ///< as the header or the line of units says it, in our spelling where it is known: "mm"
  bool is_unit_certain = false;  ///< in brackets or in a line of units
  Kind kind = Kind::Text;
  std::vector<double> values{};  ///< numbers; of times, seconds since 1970 or midnight; empty of texts; NaN: nothing
  bool has_dates = false;        ///< of times
  char decimal_sign = '.';
  std::optional<OddField> odd{};  ///< the first, of a column that holds mostly numbers: nothing should be made of it
  std::string note{};             ///< what was guessed
};

}  // namespace toftwin::table
