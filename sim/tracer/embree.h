// SPDX-License-Identifier: Apache-2.0
// All in which Embree 3 and Embree 4 differ for us. Only the tracer's sources include this.
#pragma once

#if __has_include(<embree4/rtcore.h>) && defined(TOFTWIN_EMBREE4)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <cstddef>
#include <limits>

namespace toftwin::sim::embree {

inline constexpr int kLanes = 16;  ///< rays that are traced as one packet

/// For as long as it lives, rays that are not valid begin behind their end. Where the processor has no
/// packets of sixteen (AVX2), Embree 3.13 splits them and tells valid rays by that alone; Debian's build then
/// aborts on the directions that paths which ended have left behind.
class OnlyValid {
 public:
  OnlyValid(const int* valid, RTCRay16& rays) : valid_(valid), rays_(rays) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < kLanes; ++i) {
      tnear_[i] = rays.tnear[i], tfar_[i] = rays.tfar[i];
      rays.tnear[i] = valid[i] != 0 ? tnear_[i] : kInfinity;
      rays.tfar[i] = valid[i] != 0 ? tfar_[i] : -kInfinity;
    }
  }
  OnlyValid(const OnlyValid&) = delete;
  OnlyValid& operator=(const OnlyValid&) = delete;
  ~OnlyValid() {
    for (std::size_t i = 0; i < kLanes; ++i) {
      rays_.tnear[i] = valid_[i] != 0 ? rays_.tnear[i] : tnear_[i];
      rays_.tfar[i] = valid_[i] != 0 ? rays_.tfar[i] : tfar_[i];
    }
  }

 private:
  const int* valid_;
  RTCRay16& rays_;
  float tnear_[kLanes], tfar_[kLanes];
};

#if RTC_VERSION_MAJOR >= 4

/// What Embree hands on to the functions of geometries, as it got it.
using QueryContext = RTCRayQueryContext;

inline RTCRayQueryFlags flagsFor(bool coherent) {
  return coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
}

inline void start(QueryContext& context) { rtcInitRayQueryContext(&context); }

/// Closest hit of each ray whose `valid` is −1. Coherent: the rays start or end close together.
inline void intersect(const int* valid, RTCScene scene, RTCRayHit16& rays, bool coherent) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = flagsFor(coherent);
  const OnlyValid only(valid, rays.ray);
  rtcIntersect16(valid, scene, &rays, &arguments);
}

/// Sets `tfar` to −∞ for each valid ray that meets anything. `context` was started.
inline void occluded(const int* valid, RTCScene scene, RTCRay16& rays, bool coherent, QueryContext& context) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = flagsFor(coherent);
  arguments.context = &context;
  const OnlyValid only(valid, rays);
  rtcOccluded16(valid, scene, &rays, &arguments);
}

/// The same for one ray; for comparisons.
inline void intersect(RTCScene scene, RTCRayHit& ray) { rtcIntersect1(scene, &ray, nullptr); }
inline void occluded(RTCScene scene, RTCRay& ray) { rtcOccluded1(scene, &ray, nullptr); }

#else

using QueryContext = RTCIntersectContext;

inline void start(QueryContext& context) { rtcInitIntersectContext(&context); }

inline void intersect(const int* valid, RTCScene scene, RTCRayHit16& rays, bool coherent) {
  QueryContext context;
  start(context);
  if (coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  const OnlyValid only(valid, rays.ray);
  rtcIntersect16(valid, scene, &context, &rays);
}

inline void occluded(const int* valid, RTCScene scene, RTCRay16& rays, bool coherent, QueryContext& context) {
  if (coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  const OnlyValid only(valid, rays);
  rtcOccluded16(valid, scene, &context, &rays);
}

inline void intersect(RTCScene scene, RTCRayHit& ray) {
  QueryContext context;
  start(context);
  rtcIntersect1(scene, &context, &ray);
}
inline void occluded(RTCScene scene, RTCRay& ray) {
  QueryContext context;
  start(context);
  rtcOccluded1(scene, &context, &ray);
}

#endif

inline void occluded(const int* valid, RTCScene scene, RTCRay16& rays, bool coherent) {
  QueryContext context;
  start(context);
  occluded(valid, scene, rays, coherent, context);
}

}  // namespace toftwin::sim::embree
