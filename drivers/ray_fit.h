// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include <toftwin/camera_info.h>
#include <toftwin/result.h>

/// Some cameras say where each pixel looks instead of giving a focal length.
namespace toftwin::drivers {

struct FittedCamera {
  CameraInfo camera;    ///< without calibration id
  double rms_px = 0.0;  ///< of what the model leaves
};

/// The pinhole with distortion (camera_info.h) that explains the pixels' rays best: least squares
/// in the image, Gauss-Newton. `rays`: x right, y down, z forward, three numbers per pixel, row by
/// row; those without z > 0 are left out. InvalidArgument if they are not a camera's.
Result<FittedCamera> fitCamera(int width, int height, std::span<const float> rays);

}  // namespace toftwin::drivers
