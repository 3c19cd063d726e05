// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "daemon/facades/gige_vision/features.h"

namespace toftwin::daemon::gige_vision {

/// The registers that GigE Vision prescribes: the first rows of the table.
std::vector<Row> bootstrapRows();

}  // namespace toftwin::daemon::gige_vision
