// SPDX-License-Identifier: Apache-2.0
// In what Embree 3 and Embree 4 differ for us, but for the contexts of queries with filters. Only the
// tracer's sources include this.
#pragma once

#if __has_include(<embree4/rtcore.h>) && defined(TOFTWIN_EMBREE4)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace toftwin::sim::embree {

inline constexpr int kLanes = 16;  ///< rays that are traced as one packet

/// Closest hit of each ray whose `valid` is −1. Coherent: the rays start or end close together.
inline void intersect(const int* valid, RTCScene scene, RTCRayHit16& rays, bool coherent) {
#if RTC_VERSION_MAJOR >= 4
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  if (coherent) arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect16(valid, scene, &rays, &arguments);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  if (coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(valid, scene, &context, &rays);
#endif
}

/// Sets `tfar` to −∞ for each valid ray that meets anything.
inline void occluded(const int* valid, RTCScene scene, RTCRay16& rays, bool coherent) {
#if RTC_VERSION_MAJOR >= 4
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  if (coherent) arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcOccluded16(valid, scene, &rays, &arguments);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  if (coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded16(valid, scene, &context, &rays);
#endif
}

/// The same for one ray; for comparisons.
inline void intersect(RTCScene scene, RTCRayHit& ray) {
#if RTC_VERSION_MAJOR >= 4
  rtcIntersect1(scene, &ray, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &ray);
#endif
}
inline void occluded(RTCScene scene, RTCRay& ray) {
#if RTC_VERSION_MAJOR >= 4
  rtcOccluded1(scene, &ray, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
#endif
}

}  // namespace toftwin::sim::embree
