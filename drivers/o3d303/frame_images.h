// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "drivers/o3d303/wire/frame_content.h"

namespace toftwin::drivers::o3d303 {

/// Range, depth, amplitude and flags of a frame, in that order, and which exposure a pixel is of where there
/// were several; `depth_per_range` is the z of each pixel's unit ray. Malformed if the images are not there
/// or not all of that size.
Result<std::vector<Plane>> planesOf(const toftwin::o3d303::FrameContent& content,
                                    const Image<float>& depth_per_range);

}  // namespace toftwin::drivers::o3d303
