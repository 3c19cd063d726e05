// SPDX-License-Identifier: Apache-2.0
// Sixteen rays at a time, as those who find what they meet take them.
#pragma once

#include <algorithm>
#include <array>
#include <random>

#include <toftwin/geometry.h>

#include "sim/tracer/embree.h"
#include "sim/tracer/lanes.h"

namespace toftwin::sim::testing {

using Draw = std::mt19937;

inline Vec3d pointIn(Draw& draw, double half) {
  std::uniform_real_distribution<double> along{-half, half};
  const double x = along(draw), y = along(draw);
  return {x, y, along(draw)};
}

inline Lanes<int> everyLane() {
  Lanes<int> valid;
  std::fill_n(valid.v, kLaneCount, -1);
  return valid;
}

using Places = std::array<Vec3d, kLaneCount>;

/// Sixteen rays from points to others, and beyond them as far as `reach` times.
inline RTCRayHit16 raysBetween(const Places& from, const Places& to, double reach) {
  RTCRayHit16 rays{};
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const Vec3d way = to[i] - from[i], d = way / norm(way);
    rays.ray.org_x[i] = static_cast<float>(from[i].x);
    rays.ray.org_y[i] = static_cast<float>(from[i].y);
    rays.ray.org_z[i] = static_cast<float>(from[i].z);
    rays.ray.dir_x[i] = static_cast<float>(d.x);
    rays.ray.dir_y[i] = static_cast<float>(d.y);
    rays.ray.dir_z[i] = static_cast<float>(d.z);
    rays.ray.tfar[i] = static_cast<float>(reach * norm(way));
    rays.ray.mask[i] = 0xffffffffu;
    rays.hit.geomID[i] = rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  return rays;
}

}  // namespace toftwin::sim::testing
