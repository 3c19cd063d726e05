// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/tracer/scene_impl.h"

namespace toftwin::sim {

/// Takes an object from its own frame to that of the scene.
void moveInto(BuiltObject& object, const Transform<World, Object>& scene_from_object);
/// Planes of its triangles where it stands.
void addPlanes(BuiltObject& object);
/// An object that Embree sees through an instance, as it stands there: with error bounds that count what
/// the instance's transform rounds. `own` has planes.
BuiltObject posedCopy(const BuiltObject& own, const Transform<World, Object>& scene_from_object);

}  // namespace toftwin::sim
