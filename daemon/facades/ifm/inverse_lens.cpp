// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/ifm/inverse_lens.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace toftwin::daemon::ifm {
namespace {

constexpr std::size_t kTerms = 5;
using Row = std::array<double, kTerms>;
/// Normal equations A x = b of a linear fit, A and b side by side.
using Equations = std::array<std::array<double, kTerms + 1>, kTerms>;

void add(Equations& equations, const Row& row, double value) {
  for (std::size_t i = 0; i < kTerms; ++i) {
    for (std::size_t j = 0; j < kTerms; ++j) equations[i][j] += row[i] * row[j];
    equations[i][kTerms] += row[i] * value;
  }
}

/// Gauss elimination with the largest pivot; zeros if the equations do not determine an answer.
Row solve(Equations e) {
  for (std::size_t column = 0; column < kTerms; ++column) {
    std::size_t best = column;
    for (std::size_t i = column + 1; i < kTerms; ++i) {
      if (std::abs(e[i][column]) > std::abs(e[best][column])) best = i;
    }
    std::swap(e[column], e[best]);
    if (!(std::abs(e[column][column]) > 0.0)) return {};
    for (std::size_t i = 0; i < kTerms; ++i) {
      if (i == column) continue;
      const double factor = e[i][column] / e[column][column];
      for (std::size_t j = column; j <= kTerms; ++j) e[i][j] -= factor * e[column][j];
    }
  }
  Row x{};
  for (std::size_t i = 0; i < kTerms; ++i) x[i] = e[i][kTerms] / e[i][i];
  return x;
}

}  // namespace

/// With distorted x', y' and r'² = x'² + y'²:
///   x = x' (1 + k1 r'² + k2 r'⁴ + k3 r'⁶) + 2 p1 x' y' + p2 (r'² + 2x'²)
///   y = y' (1 + k1 r'² + k2 r'⁴ + k3 r'⁶) + p1 (r'² + 2y'²) + 2 p2 x' y'
/// which is linear in the terms that are looked for.
std::array<double, 5> inverseDistortion(const CameraInfo& camera) {
  constexpr int kAlong = 24;  // points per side: five terms need few
  Equations equations{};
  for (int i = 0; i <= kAlong; ++i) {
    for (int j = 0; j <= kAlong; ++j) {
      const double u = (camera.width - 1) * static_cast<double>(i) / kAlong;
      const double v = (camera.height - 1) * static_cast<double>(j) / kAlong;
      const double x = (u - camera.cx) / camera.fx, y = (v - camera.cy) / camera.fy;
      const Vec3d ray = rayThroughPixel(camera, u, v).v;
      const double r2 = x * x + y * y;
      add(equations, {x * r2, x * r2 * r2, 2.0 * x * y, r2 + 2.0 * x * x, x * r2 * r2 * r2},
          ray.x / ray.z - x);
      add(equations, {y * r2, y * r2 * r2, r2 + 2.0 * y * y, 2.0 * x * y, y * r2 * r2 * r2},
          ray.y / ray.z - y);
    }
  }
  return solve(equations);
}

}  // namespace toftwin::daemon::ifm
