// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <toftwin/result.h>

#include "calib/table/units.h"

namespace toftwin::compare {

/// A column as --columns names it: "-t [ms]", "time_h" or "elapsed=min".
struct ColumnName {
  bool is_negated = false;  ///< by a "-" before it
  std::string in_file{};    ///< the file's name of it, without the "-" and what "=" says
  std::string unit{};       ///< what the name says its unit is, or "=" does; empty: nothing
  bool is_certain = false;  ///< by brackets or "=", so that it must be a unit
};
ColumnName columnNameOf(std::string_view given);

/// The unit that ends one of our own names of columns, such as "speed_m_per_s"; null: it has none.
const table::Unit* unitOf(std::string_view column);

/// What the values of `there` are multiplied by to be in `wanted`'s unit; nothing where `there` says no unit
/// and `wanted` has one. Errors: an unknown unit, one of another quantity.
Result<std::optional<double>> factorOf(const ColumnName& there, std::string_view wanted);

}  // namespace toftwin::compare
