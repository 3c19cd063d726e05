// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "drivers/v4l2/system.h"

namespace toftwin::drivers::v4l2 {

/// What a camera can be set to, for a person: a line for each size of each format of each of its nodes, with
/// the frame rates. "/dev/video0: Z16, 640 x 480, 30, 15 Hz". Nothing if it is not there.
std::vector<std::string> formatLines(System& system, const std::string& uri);

}  // namespace toftwin::drivers::v4l2
