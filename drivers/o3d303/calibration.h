// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/camera_info.h>
#include <toftwin/image.h>
#include <toftwin/result.h>

#include "drivers/o3d303/pcic_stream.h"

namespace toftwin::drivers::o3d303 {

/// Where the camera's pixels look, as it says itself.
struct Calibration {
  CameraInfo camera;
  Image<float> depth_per_range;  ///< z of each pixel's unit ray
};

/// Takes one frame for its unit vectors: the only place where all firmware says where pixels look.
/// `must_trigger`: it does not take frames by itself.
Result<Calibration> readCalibration(EventLoop& loop, const Endpoint& pcic, bool must_trigger,
                                    std::chrono::milliseconds within);

}  // namespace toftwin::drivers::o3d303
