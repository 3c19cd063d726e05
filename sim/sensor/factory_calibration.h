// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sim/sensor/correlate.h"

namespace toftwin::sim {

/// DecodeSettings::true_cycles of a frequency: what a factory measures when it moves a flat target away
/// from the camera, without noise. Multipath, scatter and saturation are not in it, so they are left
/// in the range, as on a real device. Where two ranges look alike, the table gives the farther one.
std::vector<float> trueCyclesOf(const Response& response, int steps);

}  // namespace toftwin::sim
