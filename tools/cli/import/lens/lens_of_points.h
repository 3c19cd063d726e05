// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "tools/cli/import/lens/lens_of_info.h"

namespace toftwin::cli {

/// The lens that puts each point at its pixel: x, y and z of every pixel, row by row, NaN where invalid. Errors: fewer than a
/// hundred points; no camera fits them.
Result<FoundLens> lensOfPoints(int width, int height, std::span<const float> points);

}  // namespace toftwin::cli
