// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/few_triangles.h"

#include <limits>

#include "sim/tracer/lanes.h"

namespace toftwin::sim {
namespace {

/// d · ((p − q) × (p + q)), twice the volume that a ray's direction and an edge span. From the triangle on its other
/// side, which goes along it the other way, it is the same number with the other sign, however it is rounded.
TOFTWIN_INLINE float beside(float dx, float dy, float dz, float px, float py, float pz, float qx, float qy, float qz) {
  const float ex = px - qx, ey = py - qy, ez = pz - qz, sx = px + qx, sy = py + qy, sz = pz + qz;
  return (ey * sz - ez * sy) * dx + (ez * sx - ex * sz) * dy + (ex * sy - ey * sx) * dz;
}

/// Where rays cross the triangle's plane; false if none does between its ends.
TOFTWIN_INLINE bool crossPlane(const FewTriangle& t, const RTCRay16& rays, const Lanes<float>& far,
                               Lanes<float>& distance) {
  int any = 0;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float ax = t.a.x - rays.org_x[i], ay = t.a.y - rays.org_y[i], az = t.a.z - rays.org_z[i];
    const float d = (ax * t.normal.x + ay * t.normal.y + az * t.normal.z) /
                    (rays.dir_x[i] * t.normal.x + rays.dir_y[i] * t.normal.y + rays.dir_z[i] * t.normal.z);
    distance[i] = d;
    any |= (d > rays.tnear[i]) & (d <= far[i]) ? 1 : 0;  // not NaN: along the plane
  }
  return any != 0;
}

/// Plücker's test: a line meets a triangle if it passes all its edges on one side.
struct Shares {
  int is_inside;  ///< or 0
  float of_b, of_c;
};
TOFTWIN_INLINE Shares sharesOf(const FewTriangle& t, const RTCRay16& rays, std::size_t i) {
  const float ox = rays.org_x[i], oy = rays.org_y[i], oz = rays.org_z[i];
  const float dx = rays.dir_x[i], dy = rays.dir_y[i], dz = rays.dir_z[i];
  const float ax = t.a.x - ox, ay = t.a.y - oy, az = t.a.z - oz;
  const float bx = t.b.x - ox, by = t.b.y - oy, bz = t.b.z - oz;
  const float cx = t.c.x - ox, cy = t.c.y - oy, cz = t.c.z - oz;
  const float of_a = beside(dx, dy, dz, bx, by, bz, cx, cy, cz), of_b = beside(dx, dy, dz, cx, cy, cz, ax, ay, az),
              of_c = beside(dx, dy, dz, ax, ay, az, bx, by, bz);
  const float ab = of_a < of_b ? of_a : of_b, least = ab < of_c ? ab : of_c;
  const float ba = of_a < of_b ? of_b : of_a, most = ba < of_c ? of_c : ba;
  const float per_all = 1.0f / (of_a + of_b + of_c);
  return {(least >= 0.0f) | (most <= 0.0f) ? 1 : 0, of_b * per_all, of_c * per_all};
}

}  // namespace

FewTriangle fewTriangle(const Vec3d& a, const Vec3d& b, const Vec3d& c, std::uint32_t object, std::uint32_t number) {
  const auto inSingle = [](const Vec3d& p) {
    return Vec3f{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
  };
  return {inSingle(a), inSingle(b), inSingle(c), inSingle(cross(b - a, c - a)), object, number};
}

TOFTWIN_VECTOR
void intersectFew(std::span<const FewTriangle> triangles, const int* valid, RTCRayHit16& rays) {
  Lanes<float> far, u, v;
  Lanes<unsigned> object, number;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    // Nothing lies before that of rays that do not count.
    far[i] = valid[i] != 0 ? rays.ray.tfar[i] : -std::numeric_limits<float>::infinity();
    u[i] = rays.hit.u[i];
    v[i] = rays.hit.v[i];
    object[i] = rays.hit.geomID[i];
    number[i] = rays.hit.primID[i];
  }
  for (const FewTriangle& of : triangles) {
    const FewTriangle t = of;
    Lanes<float> distance;
    if (!crossPlane(t, rays.ray, far, distance)) continue;
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const Shares shares = sharesOf(t, rays.ray, i);
      const bool is_met = (shares.is_inside != 0) & (distance[i] > rays.ray.tnear[i]) & (distance[i] <= far[i]);
      far[i] = is_met ? distance[i] : far[i];
      u[i] = is_met ? shares.of_b : u[i];
      v[i] = is_met ? shares.of_c : v[i];
      object[i] = is_met ? t.object : object[i];
      number[i] = is_met ? t.number : number[i];
    }
  }
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    rays.ray.tfar[i] = valid[i] != 0 ? far[i] : rays.ray.tfar[i];
    rays.hit.u[i] = u[i];
    rays.hit.v[i] = v[i];
    rays.hit.geomID[i] = object[i];
    rays.hit.primID[i] = number[i];
  }
}

TOFTWIN_VECTOR
void occludedFew(std::span<const FewTriangle> triangles, const int* valid, RTCRay16& rays) {
  Lanes<int> is_met{};
  Lanes<float> far;
  for (std::size_t i = 0; i < kLaneCount; ++i)
    far[i] = valid[i] != 0 ? rays.tfar[i] : -std::numeric_limits<float>::infinity();
  for (const FewTriangle& of : triangles) {
    const FewTriangle t = of;
    Lanes<float> distance;
    if (!crossPlane(t, rays, far, distance)) continue;
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const int is_between = (distance[i] > rays.tnear[i]) & (distance[i] <= far[i]) ? 1 : 0;
      is_met[i] |= is_between & sharesOf(t, rays, i).is_inside;
    }
  }
  constexpr float kMet = -std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < kLaneCount; ++i) rays.tfar[i] = is_met[i] != 0 ? kMet : rays.tfar[i];
}

}  // namespace toftwin::sim
