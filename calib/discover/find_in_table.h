// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/discover/finder.h"
#include "calib/discover/table_source.h"

namespace toftwin::discover {

/// The finder on a table, whose noise is estimated again with what was found, until it finds the same.
Finding findInTable(TableSource& source, FinderOptions options);

}  // namespace toftwin::discover
