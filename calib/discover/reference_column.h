// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include <toftwin/result.h>

#include "calib/discover/headers.h"
#include "calib/discover/named_columns.h"
#include "calib/discover/table_data.h"

/// Which column says what should have been measured, and whether it does so in the unit that it says.
namespace toftwin::discover {

/// Where neither map nor headers name a reference: the column of the target's distance that goes with what was measured
/// one to one, with a note. Error: there are several.
Result<> guessReference(const NamedColumns& columns, const std::filesystem::path& file, Roles& roles, TableData& data);

/// Error: what was measured goes with its reference, but by less than half or more than twice as much: a unit is
/// another than said, which a gain would hide. `scale`: units of the error in one of the reference.
Result<> checkUnits(const Roles& roles, const TableData& data, double scale);

}  // namespace toftwin::discover
