// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <toftwin/geometry.h>

#include "sim/tracer/scene_impl.h"

namespace toftwin::sim {

/// What the tracer keeps of each triangle: its plane and the error bounds of docs/tracer.md.
TrianglePlane planeOf(Vec3d v0, Vec3d v1, Vec3d v2);

/// Where a ray meets the scene, computed anew in double precision from the primitive that Embree found.
/// The hit is origin + distance · direction, moved onto the plane normal · p = level and by `onto`.
struct Contact {
  Vec3d normal;     ///< geometric, unit; of either side
  double level;
  double distance;
  double offset;    ///< how far from the surface rays that leave must start
  // Not zero only next to an edge of a triangle:
  Vec3d onto;       ///< from outside onto the edge
  Vec3d inside;     ///< away from the edge, for rays that leave
};
Contact contactOf(const BuiltObject& object, std::uint32_t primitive, float u, float v, float embree_distance,
                  Vec3d origin, Vec3d direction);

}  // namespace toftwin::sim
