// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <toftwin/geometry.h>

#include "sim/tracer/packet.h"
#include "sim/tracer/scene_impl.h"

namespace toftwin::sim {

/// What the tracer keeps of each triangle: its plane and the error bounds of docs/tracer.md.
TrianglePlane planeOf(Vec3d v0, Vec3d v1, Vec3d v2);

/// Where sixteen paths met the scene: computed anew in double precision from the primitives that Embree
/// found. Lanes that met nothing hold harmless numbers.
void findHits(const Scene::Impl& scene, const Packet& packet, const RTCRayHit16& rays, Hits& hits);

/// Where rays start that leave a hit on the other side, for light that goes through.
Vec3f startOnOtherSide(const Hits& hits, std::size_t lane);
/// Makes the other side the one from which light leaves.
void turnToOtherSide(Hits& hits, std::size_t lane);

}  // namespace toftwin::sim
