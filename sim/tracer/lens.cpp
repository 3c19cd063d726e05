// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/lens.h"

#include <array>
#include <cmath>

namespace toftwin::sim {
namespace {

/// What rayThroughPixel (camera_info.h, which has the equations) asks of its solution.
constexpr double kPrecision = 1e-12;
constexpr int kMaxSteps = 20;

}  // namespace

TOFTWIN_VECTOR
void raysOfPixels(const CameraInfo& camera, const Lanes<int>& u, const Lanes<int>& v, PixelRays& rays) {
  const double k1 = camera.distortion[0], k2 = camera.distortion[1], p1 = camera.distortion[2], p2 = camera.distortion[3],
               k3 = camera.distortion[4];
  const double fx = camera.fx, fy = camera.fy, per_fx = 1.0 / fx, per_fy = 1.0 / fy, cx = camera.cx, cy = camera.cy;
  Lanes<double> x, y, wanted_x, wanted_y;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    x[i] = wanted_x[i] = (static_cast<double>(u[i]) - cx) * per_fx;
    y[i] = wanted_y[i] = (static_cast<double>(v[i]) - cy) * per_fy;
  }
  // Newton's method, until all lanes are there; each stops by itself, so none depends on the others.
  for (int step = 0; step <= kMaxSteps; ++step) {
    int moving = 0;
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const double r2 = x[i] * x[i] + y[i] * y[i];
      const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
      const double slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
      const double cross = x[i] * y[i] * slope + 2.0 * p1 * x[i] + 2.0 * p2 * y[i];
      const double x_by_x = radial + x[i] * x[i] * slope + 2.0 * p1 * y[i] + 6.0 * p2 * x[i];
      const double y_by_y = radial + y[i] * y[i] * slope + 6.0 * p1 * y[i] + 2.0 * p2 * x[i];
      const double miss_x = x[i] * radial + 2.0 * p1 * x[i] * y[i] + p2 * (r2 + 2.0 * x[i] * x[i]) - wanted_x[i];
      const double miss_y = y[i] * radial + p1 * (r2 + 2.0 * y[i] * y[i]) + 2.0 * p2 * x[i] * y[i] - wanted_y[i];
      const double determinant = x_by_x * y_by_y - cross * cross;
      // Beyond the model's fold: the last good ray, and it alone.
      const bool is_good = determinant > 0.0;
      const double inverse = is_good ? 1.0 / determinant : 0.0;
      rays.x[i] = x[i];
      rays.y[i] = y[i];
      rays.x_by_u[i] = y_by_y * inverse * per_fx;
      rays.x_by_v[i] = -cross * inverse * per_fy;
      rays.y_by_u[i] = -cross * inverse * per_fx;
      rays.y_by_v[i] = x_by_x * inverse * per_fy;
      const bool is_moving = is_good & ((std::abs(miss_x) >= kPrecision) | (std::abs(miss_y) >= kPrecision));
      x[i] -= is_moving ? (y_by_y * miss_x - cross * miss_y) * inverse : 0.0;
      y[i] -= is_moving ? (x_by_x * miss_y - cross * miss_x) * inverse : 0.0;
      moving |= is_moving ? 1 : 0;
    }
    if (moving == 0) break;
  }
}

}  // namespace toftwin::sim
