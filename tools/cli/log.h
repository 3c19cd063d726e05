// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tools/cli/command.h"

namespace toftwin::cli {

Command logCommand();
Command trendCommand();

}  // namespace toftwin::cli
