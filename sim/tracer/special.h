// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/tracer/path.h"

namespace toftwin::sim {

/// followPaths() for scenes with more than matt surfaces in even light: every reflection model, textures,
/// surroundings and a sun, light through glass. Lane by lane where models differ, so several times slower;
/// scenes that need none of it never come here.
void followSpecialPaths(const Tracing& tracing, Packet& packet, LaneSums& sums);

/// Shadow rays from the hits to the places; what is left of the light goes into its weight and length.
void shadowRays(const Tracing& tracing, const Hits& hits, const Vec3Lanes& places, DirectLight& light,
                bool coherent);

/// Multiplies the albedo of each hit with its texture.
void applyTextures(const Scene::Impl& scene, const RTCRayHit16& rays, const Packet& packet, Hits& hits);

}  // namespace toftwin::sim
