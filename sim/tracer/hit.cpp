// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/hit.h"

#include <algorithm>
#include <array>

namespace toftwin::sim {
namespace {

constexpr double kUnitRoundoff = 0x1p-24;  // of single precision
/// Where all bounds vanish (a plane through zero), a length that does not count as denormal, even
/// multiplied with a triangle's area.
constexpr double kSmallestOffset = 1e-18;

Vec3d absolute(Vec3d v) { return {std::abs(v.x), std::abs(v.y), std::abs(v.z)}; }
Vec3d largest(Vec3d a, Vec3d b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }

/// Distance of the origin's rounding from the surface: at most half a unit in the last place per axis.
double roundingAlong(Vec3d normal, Vec3d position) {
  return kUnitRoundoff * dot(absolute(normal), absolute(position));
}

/// Bound on the error of Embree's robust triangle test, as a distance from the triangle's plane, for a
/// ray that starts at `p` on the triangle. With v_i − O rounded once per axis (error u m, m the
/// largest |v_i − O| per axis), edges of two such (|e| ≤ 2m, error 4um), normals of products of two
/// edges (error 56 u m_j m_k) and a final dot product:
///   |ΔT| ≤ 168 u m_x m_y m_z + 4 u Σ m_i |N_i|,    distance = |ΔT| / |N|
/// Embree's corners are ours rounded, which moves its plane by up to u Σ |n_i| (|p_i| + m_i) more.
double embreeTriangleError(Vec3d p, Vec3d v0, Vec3d v1, Vec3d v2, Vec3d n, double length) {
  const Vec3d m = largest(largest(absolute(v0 - p), absolute(v1 - p)), absolute(v2 - p)) +
                  absolute(p) * (2.0 * kUnitRoundoff);
  return kUnitRoundoff * (168.0 * m.x * m.y * m.z + dot(5.0 * m + absolute(p), absolute(n))) / length;
}

Hit refineTriangle(const BuiltObject& object, std::uint32_t primitive, float u, float v, Vec3d o, Vec3d d) {
  const auto& corners = object.triangles[primitive];
  const Vec3d v0 = object.vertices[corners[0]], v1 = object.vertices[corners[1]], v2 = object.vertices[corners[2]];
  const Vec3d n = cross(v1 - v0, v2 - v0);
  const double length = norm(n);
  Hit hit;
  hit.normal = n / length;
  const double slope = dot(hit.normal, d);
  const double t = dot(hit.normal, v0 - o) / slope;
  if (std::isfinite(t)) {
    const Vec3d p = o + d * t;
    hit.position = p - hit.normal * dot(hit.normal, p - v0);
  } else {  // the ray lies in the plane
    hit.position = v0 + (v1 - v0) * static_cast<double>(u) + (v2 - v0) * static_cast<double>(v);
  }
  hit.clearance = embreeTriangleError(hit.position, v0, v1, v2, n, length);
  return hit;
}

Hit refineQuadric(const Quadric& quadric, int part, float embree_distance, Vec3d o, Vec3d d) {
  const Vec3d local_o = quadric.toLocal(o - quadric.centre), local_d = quadric.toLocal(d);
  const Crossings at = crossings(quadric, part, local_o, local_d);
  // The same crossing as Embree's, whose ray was rounded; if the exact ray just misses, Embree's.
  const auto approximate = static_cast<double>(embree_distance);
  double t = approximate;
  if (std::isfinite(at.first)) t = at.first;
  if (std::isfinite(at.second) && !(std::abs(at.second - approximate) > std::abs(t - approximate) && std::isfinite(at.first))) {
    t = at.second;
  }
  const SurfacePoint point = ontoSurface(quadric, part, local_o + local_d * t);
  return {.position = quadric.centre + quadric.toScene(point.position),
          .normal = quadric.toScene(point.normal),
          .distance = t,
          .clearance = 0.0,  // its intersection is computed in double precision
          .material = 0};
}

}  // namespace

Hit refine(const Scene::Impl& scene, std::uint32_t object_id, std::uint32_t primitive, float u, float v,
           float embree_distance, Vec3d origin, Vec3d direction) {
  const BuiltObject& object = scene.objects[object_id];
  Hit hit = object.triangles.empty()
                ? refineQuadric(object.quadric, static_cast<int>(u), embree_distance, origin, direction)
                : refineTriangle(object, primitive, u, v, origin, direction);
  if (dot(hit.normal, direction) > 0.0) hit.normal = -hit.normal;
  hit.distance = norm(hit.position - origin);
  hit.material = static_cast<std::uint32_t>(object.material);
  return hit;
}

Vec3f originAbove(const Hit& hit) {
  const double offset = hit.clearance + 2.0 * roundingAlong(hit.normal, hit.position) + kSmallestOffset;
  const Vec3d p = hit.position + hit.normal * offset;
  // Rounding away from the surface on every axis
  const auto away = [](double value, double normal) {
    const auto rounded = static_cast<float>(value);
    return normal > 0.0 ? std::nextafter(rounded, INFINITY)
                        : normal < 0.0 ? std::nextafter(rounded, -INFINITY) : rounded;
  };
  return {away(p.x, hit.normal.x), away(p.y, hit.normal.y), away(p.z, hit.normal.z)};
}

}  // namespace toftwin::sim
