// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/glass.h"

#include <cmath>

namespace toftwin::sim {
namespace {

/// Embree hands the context on to the filters as it got it.
struct Context {
  embree::QueryContext embree;
  ThroughGlass* through;
};

/// Each pane on the way is met here once; the ray is told that it met nothing.
void filter(const RTCFilterFunctionNArguments* arguments) {
  const auto& glass = *static_cast<const bsdf::ThinGlass*>(arguments->geometryUserPtr);
  const unsigned n = arguments->N;
  for (unsigned i = 0; i < n; ++i) {
    if (arguments->valid[i] != -1) continue;
    const Vec3d normal{static_cast<double>(RTCHitN_Ng_x(arguments->hit, n, i)),
                       static_cast<double>(RTCHitN_Ng_y(arguments->hit, n, i)),
                       static_cast<double>(RTCHitN_Ng_z(arguments->hit, n, i))};
    const Vec3d direction{static_cast<double>(RTCRayN_dir_x(arguments->ray, n, i)),
                          static_cast<double>(RTCRayN_dir_y(arguments->ray, n, i)),
                          static_cast<double>(RTCRayN_dir_z(arguments->ray, n, i))};
    crossGlass(arguments->context, RTCRayN_id(arguments->ray, n, i), glass,
               dot(normal, direction) / (norm(normal) * norm(direction)));
    arguments->valid[i] = 0;
  }
}

}  // namespace

void crossGlass(embree::QueryContext* context, unsigned lane, const bsdf::ThinGlass& glass, double cosine) {
  ThroughGlass& through = *reinterpret_cast<Context*>(context)->through;
  through.share[lane] *= static_cast<float>(glass.shares(cosine).transmitted);
  through.extra_m[lane] += glass.extraLength(cosine);
}

void letShadowRaysThrough(RTCGeometry geometry, const bsdf::ThinGlass& glass) {
  // The filter only reads through the pointer.
  rtcSetGeometryUserData(geometry, const_cast<bsdf::ThinGlass*>(&glass));
  rtcSetGeometryOccludedFilterFunction(geometry, filter);
}

void startThroughGlass(RTCRay16& rays, ThroughGlass& through) {
  for (unsigned i = 0; i < kLaneCount; ++i) {
    rays.id[i] = i;
    through.share[i] = 1.0f;
    through.extra_m[i] = 0.0;
  }
}

void occludedThroughGlass(const int* valid, RTCScene scene, RTCRay16& rays, bool coherent,
                          ThroughGlass& through) {
  Context context;
  embree::start(context.embree);
  context.through = &through;
  embree::occluded(valid, scene, rays, coherent, context.embree);
}

}  // namespace toftwin::sim
