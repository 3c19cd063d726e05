// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "sim/tracer/emitter.h"
#include "sim/tracer/packet.h"
#include "sim/tracer/scene_impl.h"

namespace toftwin::sim {

struct Tracing;
struct DirectLight;

/// A plane of the scene that mirrors: normal · p = level, part of one object.
struct MirrorPlane {
  std::size_t object = 0;
  Vec3d normal;  ///< unit
  double level = 0.0;
};
/// Of all flat mirrors: objects of mirrors with few planes. Others are curved, and have no images.
std::vector<MirrorPlane> mirrorPlanes(const Scene::Impl& scene);
/// Whether these are all mirrors that the scene has.
bool areAllMirrorsFlat(const Scene::Impl& scene);

/// A point emitter behind a mirror, as it is seen in it.
struct MirroredEmitter {
  MirrorPlane plane;
  Vec3d emitter;        ///< where it stands
  PlacedEmitter image;  ///< where it seems to stand
};
/// The images of all points in all flat mirrors, over one reflection. Discs need none: paths meet them.
std::vector<MirroredEmitter> mirroredEmitters(const Scene::Impl& scene,
                                              std::span<const PlacedEmitter> emitters);

/// What of the image's light reaches the hits: the way must meet the mirror's plane, on that object, first,
/// and go on from there to the emitter. `light` is that of the image, before anything is in its way.
void throughMirror(const Tracing& tracing, const Packet& packet, const Hits& hits,
                   const MirroredEmitter& mirrored, DirectLight& light);

}  // namespace toftwin::sim
