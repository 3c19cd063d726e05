// SPDX-License-Identifier: Apache-2.0
#include <toftwin/camera_info.h>

#include <cmath>

namespace toftwin {
namespace {

struct Distorted {
  double x, y;                    // x', y' of the equations in the header
  double dx_dx, dx_dy, dy_dx, dy_dy;  // their derivatives by x and y
};

Distorted distort(const std::array<double, 5>& d, double x, double y) {
  const auto [k1, k2, p1, p2, k3] = d;
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double radial_by_r2 = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);
  return {.x = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
          .y = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
          .dx_dx = radial + 2.0 * x * x * radial_by_r2 + 2.0 * p1 * y + 6.0 * p2 * x,
          .dx_dy = 2.0 * x * y * radial_by_r2 + 2.0 * p1 * x + 2.0 * p2 * y,
          .dy_dx = 2.0 * x * y * radial_by_r2 + 2.0 * p1 * x + 2.0 * p2 * y,
          .dy_dy = radial + 2.0 * y * y * radial_by_r2 + 6.0 * p1 * y + 2.0 * p2 * x};
}

}  // namespace

Direction<Camera> rayThroughPixel(const CameraInfo& camera, double u, double v) {
  const double target_x = (u - camera.cx) / camera.fx;
  const double target_y = (v - camera.cy) / camera.fy;
  double x = target_x, y = target_y;
  if (camera.distortion != std::array<double, 5>{}) {
    for (int step = 0; step < 20; ++step) {
      const Distorted at = distort(camera.distortion, x, y);
      const double miss_x = at.x - target_x, miss_y = at.y - target_y;
      if (std::abs(miss_x) < 1e-12 && std::abs(miss_y) < 1e-12) break;
      const double determinant = at.dx_dx * at.dy_dy - at.dx_dy * at.dy_dx;
      if (determinant <= 0.0) break;  // beyond the fold of the model: keep the last good ray
      x -= (at.dy_dy * miss_x - at.dx_dy * miss_y) / determinant;
      y -= (at.dx_dx * miss_y - at.dy_dx * miss_x) / determinant;
    }
  }
  return {normalised(Vec3d{x, y, 1.0})};
}

std::array<double, 2> pixelOfPoint(const CameraInfo& camera, Point<Camera> point) {
  const Distorted at =
      distort(camera.distortion, point.m.x / point.m.z, point.m.y / point.m.z);
  return {camera.fx * at.x + camera.cx, camera.fy * at.y + camera.cy};
}

}  // namespace toftwin
