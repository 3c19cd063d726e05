// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/tracer/bsdf/mirror.h"
#include "sim/tracer/embree.h"
#include "sim/tracer/lanes.h"

namespace toftwin::sim {

/// What is left of sixteen shadow rays behind the panes that they crossed.
struct ThroughGlass {
  Lanes<float> share;     ///< of the light
  Lanes<double> extra_m;  ///< optical length
};

/// Makes shadow rays go through a geometry of thin glass: occludedThroughGlass() counts what that costs.
void letShadowRaysThrough(RTCGeometry geometry, const bsdf::ThinGlass& glass);
/// The same for one crossing of a shape that finds its crossings itself.
void crossGlass(embree::QueryContext* context, unsigned lane, const bsdf::ThinGlass& glass, double cosine);

/// Nothing is crossed yet. The rays' ids become their lanes.
void startThroughGlass(RTCRay16& rays, ThroughGlass& through);
/// embree::occluded() for scenes with glass; adds to what was crossed.
void occludedThroughGlass(const int* valid, RTCScene scene, RTCRay16& rays, bool coherent,
                          ThroughGlass& through);

}  // namespace toftwin::sim
