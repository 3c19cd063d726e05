// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <toftwin/result.h>

#include "calib/table/table.h"
#include "calib/table/table_map.h"

namespace toftwin::table {

/// Which column is what, by their places in the table.
struct Roles {
  std::optional<std::size_t> measured{}, reference{}, error{}, sigma{}, session{}, capture{}, locked{};
  bool is_reversed = false;           ///< error is reference − measured
  bool is_reference_said = false;     ///< by the map
  /// Columns that could be the measured values or the reference as well, by their words.
  std::vector<std::size_t> other_references{};
  std::vector<std::pair<std::size_t, MapNature>> covariates{};
  [[nodiscard]] bool isUsed(std::size_t column) const;
};

/// By the map, and where it is silent by the headers' words. Errors: a column of the map that is not there, or one with
/// two roles; neither measured values nor errors to be found, or several that could be them.
Result<Roles> rolesOf(const Table& table, const TableMap& map);

/// "error = depth_mm − reference_mm; session = day; covariates: time_s".
std::string inWords(const Table& table, const Roles& roles);

}  // namespace toftwin::table
