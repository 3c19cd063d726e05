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
  /// How far along the normal a new ray must start so that single-precision arithmetic cannot find
  /// it on the wrong side of this surface (docs/tracer.md derives it).
  double clearance;
  std::uint32_t material;
};

/// Computes the hit that Embree found in single precision anew: the given primitive with the exact ray.
Hit refine(const Scene::Impl& scene, std::uint32_t object, std::uint32_t primitive, float u, float v,
           float embree_distance, Vec3d origin, Vec3d direction);

/// A single-precision origin for rays that leave `hit` on the normal's side: on that side of the
/// surface after rounding, and no further away than rounding makes necessary.
Vec3f originAbove(const Hit& hit);

}  // namespace toftwin::sim
