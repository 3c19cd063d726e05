// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include <toftwin/image.h>

namespace toftwin::sim {

using Pixel = std::array<int, 2>;  ///< x, y

/// The pixels where depth jumps, row by row; none on the image's border.
std::vector<Pixel> pixelsWithJumps(const Image<float>& range_m);

}  // namespace toftwin::sim
