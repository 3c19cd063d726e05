// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/tracer/embree.h"
#include "sim/tracer/scene_impl.h"

namespace toftwin::sim {

/// A user geometry that intersects the object's quadric; the object must outlive it. A hit's `u` holds the part.
RTCGeometry makeQuadricGeometry(RTCDevice device, const BuiltObject& object);

}  // namespace toftwin::sim
