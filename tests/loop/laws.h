// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Laws that hold for every table: what is said must not depend on how the table is written. Tables are texts here, so that the
/// reader is held to them, too.
namespace toftwin::testing {

/// A table of fields.
struct TextTable {
  std::vector<std::string> header{};
  std::vector<std::vector<std::string>> rows{};
};
TextTable parsedTable(const std::string& csv);
std::string csvOf(const TextTable& table);

/// A change of how a table is written.
struct Law {
  std::string_view name;
  /// The changed table; equal to the one given where the law does not apply.
  TextTable (*changed)(const TextTable& table, std::uint64_t seed);
};
std::span<const Law> laws();

/// What was said of a table, without its numbers: "column; reference, ..." in an order of its own. `names` that a law changes are
/// said by their order in the file.
std::string verdictOf(const std::string& csv);

}  // namespace toftwin::testing
