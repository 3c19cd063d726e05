// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace toftwin::table {

/// What a column's numbers are, which decides what shapes an error over them can have.
enum class Nature : std::uint8_t {
  Number,    ///< any quantity
  Length,    ///< a distance; waves of a known modulation are looked for
  Time,      ///< seconds, since the first row where the file gives dates or times of day
  Angle,     ///< degrees
  Index,     ///< whole numbers that count: columns, rows, frames
  Category,  ///< names without order
};

/// How a column's numbers stand in the file, to write them so again.
struct AsWritten {
  std::string unit{};   ///< that header or units row says; may be empty
  double factor = 1.0;  ///< our values are so many times the file's; negative where an error has the other sign there
};

struct Column {
  std::string header{};  ///< as in the file, without spaces at its ends
  std::string unit{};    ///< "mm", "s", "degC"; empty where neither header nor units row says one
  Nature nature = Nature::Number;
  std::vector<double> values{};      ///< NaN where missing; of a category the index into `words`
  std::vector<std::string> words{};  ///< of a category, in the order they come in the file
  /// Of a column of dates or times of day: its first, from which the values count; seconds since 1970 or midnight.
  std::optional<double> first{};
  AsWritten written{};  ///< of numbers that do not count from a first
};

}  // namespace toftwin::table
