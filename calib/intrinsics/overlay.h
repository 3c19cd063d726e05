// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "calib/intrinsics/verdict.h"

namespace toftwin::intrinsics {

/// A picture of one view as PNG, enlarged: what was found (circles), and by 50 times where the lens predicts it
/// instead (lines), green to red for 0 to 0.3 px; a rejected view with its reason.
std::vector<std::byte> overlayPng(const Calibrated& calibrated, std::size_t sighting, const Image<float>& image);

}  // namespace toftwin::intrinsics
