// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/tracer/scene_impl.h"

namespace toftwin::sim {

/// Takes an object from its own frame to that of the scene.
void moveInto(BuiltObject& object, const Transform<World, Object>& scene_from_object);
/// Planes of its triangles, in the frame that it is in.
void addPlanes(BuiltObject& object);
/// The largest coordinate of anything on it, in its own frame.
double reachOf(const BuiltObject& own);
/// Radius of a ball around it, whose middle is that of its box in its own frame.
double radiusOf(const BuiltObject& own, const RTCBounds& box);
/// Of 4096 lines drawn through that ball; not of glass. Its core is where none of at least 1024 of them came through: in
/// truth fewer than three in a thousand do (95 %), all of them near its edge unless the thing has small holes.
Hiding hidesOf(RTCScene mover, const RTCBounds& box, double radius);

}  // namespace toftwin::sim
