// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/lens.h"

namespace toftwin::sim {

PixelRays raysOfPixel(const CameraInfo& camera, int u, int v) {
  const Vec3d centre = rayThroughPixel(camera, u, v).v;
  PixelRays rays{.x = centre.x / centre.z, .y = centre.y / centre.z};
  // The distortion's derivatives (camera_info.h gives the equations); its inverse's are the inverse matrix.
  const auto [k1, k2, p1, p2, k3] = camera.distortion;
  const double x = rays.x, y = rays.y, r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
  const double u_by_x = camera.fx * (radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x);
  const double u_by_y = camera.fx * (x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y);
  const double v_by_x = camera.fy * (x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y);
  const double v_by_y = camera.fy * (radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x);
  const double determinant = u_by_x * v_by_y - u_by_y * v_by_x;
  if (!(determinant > 0.0)) return rays;  // beyond the model's fold: the central ray alone
  rays.x_by_u = v_by_y / determinant;
  rays.x_by_v = -u_by_y / determinant;
  rays.y_by_u = -v_by_x / determinant;
  rays.y_by_v = u_by_x / determinant;
  return rays;
}

}  // namespace toftwin::sim
