// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/cast.h"

#include <limits>

#include "sim/tracer/pairs.h"

namespace toftwin::sim {
namespace {

/// A standing in single precision, for lanes.
struct Frame {
  float ax, ay, az, bx, by, bz, cx, cy, cz;  ///< the object's axes
  float tx, ty, tz;
  Vec3f lower, upper;
};

TOFTWIN_INLINE Frame frameOf(const Standing& standing) {
  const auto& [a, b, c] = standing.axes;
  const Vec3d t = standing.scene_from_object.translation_m;
  const auto f = [](double v) { return static_cast<float>(v); };
  return {f(a.x), f(a.y), f(a.z), f(b.x), f(b.y), f(b.z), f(c.x), f(c.y), f(c.z),
          f(t.x), f(t.y), f(t.z), standing.lower, standing.upper};
}

/// Where a ray is between two planes across one axis, widened by `pad`.
TOFTWIN_INLINE void clip(float o, float d, float lower, float upper, float pad, float& first, float& last) {
  const float size = d < 0.0f ? -d : d;
  const float slope = size < 1e-12f ? 1e-12f : d, per_slope = 1.0f / slope;
  const float a = (lower - pad - o) * per_slope, b = (upper + pad - o) * per_slope;
  const float enter = a < b ? a : b, leave = a < b ? b : a;
  first = enter > first ? enter : first;
  last = leave < last ? leave : last;
}

/// Takes rays into the object's frame; false if none can meet its box. All that is rounded here and in Embree
/// moves a ray by less than 40 units of roundoff of the coordinates' sum, a quarter of what the box is widened by.
TOFTWIN_VECTOR
bool takeInto(const Frame& frame, const int* valid, const RTCRay16& rays, int* can_meet, RTCRay16& local) {
  const Frame f = frame;
  const auto larger = [](float a, float b) { return a > b ? a : b; };
  const float reach = larger(larger(larger(-f.lower.x, f.upper.x), larger(-f.lower.y, f.upper.y)),
                             larger(-f.lower.z, f.upper.z));
  int any = 0;
#pragma GCC ivdep
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float px = rays.org_x[i] - f.tx, py = rays.org_y[i] - f.ty, pz = rays.org_z[i] - f.tz;
    const float vx = rays.dir_x[i], vy = rays.dir_y[i], vz = rays.dir_z[i];
    const float ox = f.ax * px + f.ay * py + f.az * pz, dx = f.ax * vx + f.ay * vy + f.az * vz;
    const float oy = f.bx * px + f.by * py + f.bz * pz, dy = f.bx * vx + f.by * vy + f.bz * vz;
    const float oz = f.cx * px + f.cy * py + f.cz * pz, dz = f.cx * vx + f.cy * vy + f.cz * vz;
    const auto size = [](float v) { return v < 0.0f ? -v : v; };
    const float sum = size(rays.org_x[i]) + size(rays.org_y[i]) + size(rays.org_z[i]) + size(f.tx) + size(f.ty) +
                      size(f.tz) + reach;
    const float pad = 1e-5f * sum;
    float first = rays.tnear[i], last = rays.tfar[i];
    clip(ox, dx, f.lower.x, f.upper.x, pad, first, last);
    clip(oy, dy, f.lower.y, f.upper.y, pad, first, last);
    clip(oz, dz, f.lower.z, f.upper.z, pad, first, last);
    can_meet[i] = (first <= last) & (valid[i] != 0) ? -1 : 0;
    any |= can_meet[i];
    local.org_x[i] = ox;
    local.org_y[i] = oy;
    local.org_z[i] = oz;
    local.dir_x[i] = dx;
    local.dir_y[i] = dy;
    local.dir_z[i] = dz;
    local.tfar[i] = rays.tfar[i];
  }
  if (any == 0) return false;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    local.tnear[i] = rays.tnear[i];
    local.time[i] = 0.0f;
    local.mask[i] = 0xffffffffu;
    local.id[i] = rays.id[i];
    local.flags[i] = 0;
  }
  return true;
}

/// Of still objects.
TOFTWIN_VECTOR
void takeQuadranglesApart(const std::vector<std::uint32_t>& are_paired, RTCHit16& hits) {
  const std::uint32_t* table = are_paired.data();
  const auto nothing = static_cast<unsigned>(are_paired.size() - 1);
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const unsigned object = hits.geomID[i] < nothing ? hits.geomID[i] : nothing;
    takeApart(table[object] != 0, hits.primID[i], hits.u[i], hits.v[i]);
  }
}

/// What was met in the object's frame is nearer than what was met before: Embree saw `tfar`.
TOFTWIN_VECTOR
void takeBack(const RTCRayHit16& local, const int* can_meet, bool is_paired, RTCRayHit16& rays) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const bool is_met = (can_meet[i] != 0) & (local.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID);
    unsigned primitive = local.hit.primID[i];
    float u = local.hit.u[i], v = local.hit.v[i];
    takeApart(is_paired, primitive, u, v);
    rays.ray.tfar[i] = is_met ? local.ray.tfar[i] : rays.ray.tfar[i];
    rays.hit.u[i] = is_met ? u : rays.hit.u[i];
    rays.hit.v[i] = is_met ? v : rays.hit.v[i];
    rays.hit.geomID[i] = is_met ? local.hit.geomID[i] : rays.hit.geomID[i];
    rays.hit.primID[i] = is_met ? primitive : rays.hit.primID[i];
  }
}

TOFTWIN_VECTOR
void takeBack(const RTCRay16& local, const int* can_meet, RTCRay16& rays) {
  constexpr float kMet = -std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < kLaneCount; ++i)
    rays.tfar[i] = (can_meet[i] != 0) & (local.tfar[i] < 0.0f) ? kMet : rays.tfar[i];
}

/// Shadow rays in the movers' frames; `occluded(valid, scene, rays)` is Embree's part.
template <class Occluded>
TOFTWIN_INLINE void castAtMovers(const Scene::Impl& scene, const int* valid, RTCRay16& rays, const Occluded& occluded) {
  for (const Standing& standing : scene.poses) {
    Lanes<int> can_meet;
    RTCRay16 local;
    if (!takeInto(frameOf(standing), valid, rays, can_meet.v, local)) continue;
    occluded(can_meet.v, standing, local);
    takeBack(local, can_meet.v, rays);
  }
}

}  // namespace

TOFTWIN_VECTOR
void castRays(const Scene::Impl& scene, const int* valid, RTCRayHit16& rays, bool coherent) {
  if (!scene.still_few.empty()) {
    intersectFew(scene.still_few, valid, rays);
  } else {
    embree::intersect(valid, scene.still, rays, coherent);
  }
  if (!scene.still_pairs.empty()) takeQuadranglesApart(scene.still_pairs, rays.hit);
  for (const Standing& standing : scene.poses) {
    Lanes<int> can_meet;
    RTCRayHit16 local;
    if (!takeInto(frameOf(standing), valid, rays.ray, can_meet.v, local.ray)) continue;
    for (std::size_t i = 0; i < kLaneCount; ++i)
      local.hit.geomID[i] = local.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    const bool is_done =
        coherent && standing.tree != nullptr && standing.tree->intersect(can_meet.v, standing.object, local);
    if (!is_done) embree::intersect(can_meet.v, standing.embree, local, coherent);
    takeBack(local, can_meet.v, standing.is_paired && !is_done, rays);
  }
}

TOFTWIN_VECTOR
void castShadowRays(const Scene::Impl& scene, const int* valid, RTCRay16& rays, bool coherent) {
  if (!scene.still_few.empty()) {
    occludedFew(scene.still_few, valid, rays);
  } else {
    embree::occluded(valid, scene.still, rays, coherent);
  }
  castAtMovers(scene, valid, rays, [&](const int* can_meet, const Standing& mover, RTCRay16& local) {
    if (coherent && mover.tree != nullptr && mover.tree->occluded(can_meet, local)) return;
    embree::occluded(can_meet, mover.embree, local, coherent);
  });
}

void castShadowRays(const Scene::Impl& scene, const int* valid, RTCRay16& rays, bool coherent, ThroughGlass& through) {
  startThroughGlass(rays, through);
  occludedThroughGlass(valid, scene.still, rays, coherent, through);
  castAtMovers(scene, valid, rays, [&](const int* can_meet, const Standing& mover, RTCRay16& local) {
    occludedThroughGlass(can_meet, mover.embree, local, coherent, through);
  });
}

}  // namespace toftwin::sim
