// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <toftwin/result.h>

#include "tools/cli/command.h"

namespace toftwin::cli {

/// Prints the topics of a bag (ROS 2, ROS 1, Foxglove) and which of them toftwin import takes. Incomplete where it is damaged.
Result<Exit> describeBag(const std::string& what, bool as_json);

}  // namespace toftwin::cli
