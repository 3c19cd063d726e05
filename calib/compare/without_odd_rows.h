// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/compare/named_traits.h"
#include "calib/compare/trait_verdict.h"

/// What numbers of tables are without rows that put them in doubt (traits/odd_rows.h), beside those of all rows.
namespace toftwin::compare {

/// A table's rows that are far off, of the finite ones, from 0.
struct OddRowsOfTable {
  std::string of{};  ///< "A" or "B"
  std::vector<std::size_t> rows{};
};
/// Of each table that has some.
std::vector<OddRowsOfTable> oddRowsOfTables(const NamedTraits& traits);

/// Numbers of the same tables without them, and how the two cameras are held against each other then.
struct WithoutOddRows {
  std::vector<OddRowsOfTable> left_out{};
  NamedTraits traits{};
  std::vector<TraitVerdict> verdicts{};
};

/// "Without row 45 of B: " and what is clearest then.
std::string inWords(const WithoutOddRows& without);
/// Numbers of the tables that have such rows: of all, as `all` has them, and without.
TableBlock besideAllRows(const NamedTraits& all, const WithoutOddRows& without);
/// left_out (rows from 1), characteristics and verdicts.
Json toJson(const WithoutOddRows& without);

}  // namespace toftwin::compare
