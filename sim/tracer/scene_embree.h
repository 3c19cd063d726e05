// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sim/tracer/scene_impl.h"

namespace toftwin::sim {

/// An object and the geometry id that it gets.
struct NumberedObject {
  unsigned id;
  const BuiltObject* object;
};

/// An Embree scene of these objects, ready to be traced or shown by instances. They must outlive it.
RTCScene makeEmbreeScene(RTCDevice device, const std::vector<NumberedObject>& objects);

/// An Embree scene that shows the still part and each mover at its pose (scene frame).
RTCScene makeInstances(const Scene::Impl& loaded, const std::vector<Transform<World, Object>>& poses);

}  // namespace toftwin::sim
