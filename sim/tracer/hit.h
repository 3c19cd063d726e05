// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include <toftwin/geometry.h>

#include "sim/tracer/scene_impl.h"

namespace toftwin::sim {

/// Where a ray meets the scene, in the scene's frame.
struct Hit {
  Vec3d position;   ///< on the surface, to double precision
  Vec3d normal;     ///< geometric, unit, on the side that the ray comes from
  double distance;  ///< along the ray
  /// Where rays that leave on the normal's side start in single precision: after rounding on that side
  /// of this surface and of those that share an edge with it, and no further away from `position` than
  /// the error bounds of the arithmetic make necessary (docs/tracer.md derives them).
  Vec3f start;
  std::uint32_t material;
};

/// Computes the hit that Embree found in single precision anew: the given primitive with the exact ray.
Hit refine(const Scene::Impl& scene, std::uint32_t object, std::uint32_t primitive, float u, float v,
           float embree_distance, Vec3d origin, Vec3d direction);

}  // namespace toftwin::sim
