// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/tracer/embree.h"
#include "sim/tracer/quadric.h"

namespace toftwin::sim {

/// A user geometry that intersects the quadric, which must outlive it. A hit's `u` holds the part.
RTCGeometry makeQuadricGeometry(RTCDevice device, const Quadric& quadric);

}  // namespace toftwin::sim
