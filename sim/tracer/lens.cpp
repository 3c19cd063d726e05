// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/lens.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace toftwin::sim {
namespace {

/// A step of Newton's method that mends so small a miss leaves none: the next is its square.
constexpr double kLastMiss = 1e-7;
constexpr int kMaxSteps = 20;

/// Where Newton's method starts: r / r′ as a polynomial of r′², for a lens without tangential distortion,
/// through values at Chebyshev's places up to the image's corner. 1 where the model has folded before.
Lens::Start startOf(const CameraInfo& camera) {
  Lens::Start start{.terms = {1.0}, .end = 0.0};
  for (const double u : {-0.5, camera.width - 0.5}) {
    for (const double v : {-0.5, camera.height - 0.5}) {
      const double x = (u - camera.cx) / camera.fx, y = (v - camera.cy) / camera.fy;
      start.end = std::max(start.end, x * x + y * y);
    }
  }
  CameraInfo radial{.width = 1, .height = 1, .fx = 1.0, .fy = 1.0, .cx = 0.0, .cy = 0.0, .distortion = camera.distortion, .calibration_id = {}};
  radial.distortion[2] = radial.distortion[3] = 0.0;
  constexpr std::size_t n = Lens::kStartTerms;
  std::array<double, n> place{}, value{};
  for (std::size_t i = 0; i < n; ++i) {
    place[i] = 0.5 * start.end * (1.0 - std::cos(std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(n)));
    const double distorted = std::sqrt(place[i]);
    const Direction<Camera> ray = rayThroughPixel(radial, distorted, 0.0);
    const double found = ray.v.x / ray.v.z;
    if (std::abs(pixelOfPoint(radial, Point<Camera>{{found, 0.0, 1.0}})[0] - distorted) > 1e-9) return start;
    value[i] = found / distorted;
  }
  // Newton's divided differences, then powers.
  for (std::size_t order = 1; order < n; ++order) {
    for (std::size_t i = n - 1; i >= order; --i) value[i] = (value[i] - value[i - 1]) / (place[i] - place[i - order]);
  }
  start.terms = {value[n - 1]};
  for (std::size_t i = n - 1; i-- > 0;) {
    for (std::size_t power = n - 1; power > 0; --power) {
      start.terms[power] = start.terms[power - 1] - place[i] * start.terms[power];
    }
    start.terms[0] = value[i] - place[i] * start.terms[0];
  }
  return start;
}

TOFTWIN_VECTOR
void invert(const CameraInfo& camera, const Lens::Start& start, const Lanes<int>& u, const Lanes<int>& v, PixelRays& rays) {
  const double k1 = camera.distortion[0], k2 = camera.distortion[1], p1 = camera.distortion[2], p2 = camera.distortion[3],
               k3 = camera.distortion[4];
  const double fx = camera.fx, fy = camera.fy, per_fx = 1.0 / fx, per_fy = 1.0 / fy, cx = camera.cx, cy = camera.cy;
  const double* terms = start.terms.data();
  const double end = start.end;
  Lanes<double> x, y, wanted_x, wanted_y;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    wanted_x[i] = (static_cast<double>(u[i]) - cx) * per_fx;
    wanted_y[i] = (static_cast<double>(v[i]) - cy) * per_fy;
    const double squared = wanted_x[i] * wanted_x[i] + wanted_y[i] * wanted_y[i], r2 = squared < end ? squared : end;
    double factor = terms[Lens::kStartTerms - 1];
    for (int power = Lens::kStartTerms - 2; power >= 0; --power) factor = factor * r2 + terms[power];
    x[i] = wanted_x[i] * factor;
    y[i] = wanted_y[i] * factor;
  }
  // Newton's method (camera_info.h has the equations) until all lanes are there.
  for (int step = 0; step < kMaxSteps; ++step) {
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
      rays.x_by_u[i] = y_by_y * inverse * per_fx;
      rays.x_by_v[i] = -cross * inverse * per_fy;
      rays.y_by_u[i] = -cross * inverse * per_fx;
      rays.y_by_v[i] = x_by_x * inverse * per_fy;
      const bool is_moving = is_good & ((std::abs(miss_x) > kLastMiss) | (std::abs(miss_y) > kLastMiss));
      x[i] -= (y_by_y * miss_x - cross * miss_y) * inverse;
      y[i] -= (x_by_x * miss_y - cross * miss_x) * inverse;
      moving |= is_moving ? 1 : 0;
    }
    if (moving == 0) break;
  }
  rays.x = x;
  rays.y = y;
}

}  // namespace

Lens::Lens(const CameraInfo& camera) : camera_(camera), start_(startOf(camera)) {}

void Lens::raysOf(const Lanes<int>& u, const Lanes<int>& v, PixelRays& rays) const { invert(camera_, start_, u, v, rays); }

}  // namespace toftwin::sim
