// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <toftwin/geometry.h>

#include "sim/tracer/embree.h"

namespace toftwin::sim {

/// A triangle among so few that sixteen rays are tested with all of them sooner than a tree is gone down: rooms that
/// are boxes, walls, tables. Numbers and corners as Embree would have them.
struct FewTriangle {
  Vec3f a, b, c;
  Vec3f normal;  ///< of any length
  std::uint32_t object, number;
};

FewTriangle fewTriangle(const Vec3d& a, const Vec3d& b, const Vec3d& c, std::uint32_t object, std::uint32_t number);

/// So few: with as many, rays that go anywhere take two thirds of the time that Embree takes.
inline constexpr std::size_t kFewTriangles = 32;

/// Closest hits, and shadow rays, of the rays whose `valid` is -1, as embree::intersect() and occluded() give them;
/// they change nothing for rays that meet none. Along the edges of a mesh a ray meets one of the two triangles.
void intersectFew(std::span<const FewTriangle> triangles, const int* valid, RTCRayHit16& rays);
void occludedFew(std::span<const FewTriangle> triangles, const int* valid, RTCRay16& rays);

}  // namespace toftwin::sim
