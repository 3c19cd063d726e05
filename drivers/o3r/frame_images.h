// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <toftwin/frame.h>
#include <toftwin/image.h>
#include <toftwin/result.h>

#include "drivers/o3d303/wire/frame_content.h"
#include "drivers/o3r/wire/head_info.h"

namespace toftwin::drivers::o3r {

/// Where a head's pixels look.
struct Optics {
  CameraInfo camera;
  Image<float> depth_per_range;  ///< z of each pixel's unit ray
};
/// Of the lens models in TOF_INFO: model 1 is ours; of others the rays are fitted. InvalidArgument: they are
/// no camera's.
Result<Optics> opticsOf(const toftwin::o3r::TofInfo& info, int width, int height);

/// Range, depth, amplitude and flags of a frame, in that order, and which exposure a pixel is of where there
/// were several. Malformed if the chunks are not there, or of another size than the optics.
Result<std::vector<Plane>> planesOf(const toftwin::o3d303::FrameContent& content,
                                    const toftwin::o3r::TofInfo& info, const Optics& optics);
/// TOF_INFO of a frame.
Result<toftwin::o3r::TofInfo> infoOf(const toftwin::o3d303::FrameContent& content);

}  // namespace toftwin::drivers::o3r
