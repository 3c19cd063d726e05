// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/camera_info.h>
#include <toftwin/geometry.h>

namespace toftwin::sim {

/// The rays of one pixel's footprint: the central ray exactly, the others by the derivative of the
/// inverse distortion. Error: half the second derivative times the squared offset; half a pixel from
/// the centre below 1e-6 rad in most of a Kinect's image, 4e-6 rad in its last corner.
struct PixelRays {
  double x = 0.0, y = 0.0;  ///< of the central ray on the plane z = 1
  double x_by_u = 0.0, x_by_v = 0.0, y_by_u = 0.0, y_by_v = 0.0;

  /// Unit direction in the camera's frame at (du, dv) pixels from the centre.
  [[nodiscard]] Vec3d direction(double du, double dv) const {
    return normalised(Vec3d{x + x_by_u * du + x_by_v * dv, y + y_by_u * du + y_by_v * dv, 1.0});
  }
};

PixelRays raysOfPixel(const CameraInfo& camera, int u, int v);

}  // namespace toftwin::sim
