// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "calib/compare/json.h"
#include "drivers/source.h"

namespace toftwin::cli {

/// What a reader of a report on a camera must know before its checks, line by line: what with its value.
using ReportHeader = std::vector<std::pair<std::string, compare::Json>>;

/// The software and the machine. Libraries are those that the drivers have loaded by then.
ReportHeader headerOfMachine(const std::string& camera, const std::string& keys);
/// The camera as it says of itself, and the rate at which its frames come; it is started for that, and stopped again.
ReportHeader headerOfCamera(drivers::Source& source, std::chrono::milliseconds frame_timeout);

}  // namespace toftwin::cli
