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

/// How far rounding the position to single precision can move it across the surface.
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

/// The move along the triangle that keeps a place at least `margin` away from its three edges: a ray
/// that starts on an edge could start behind the surface that begins there.
/// `n` is (v1 − v0) × (v2 − v0) and `length` its norm; u and v as Embree counts them, which tell only
/// roughly whether an edge is near: their errors are a few 1e-7 of the triangle's height.
Vec3d awayFromEdges(Vec3d p, double u, double v, Vec3d v0, Vec3d v1, Vec3d v2, Vec3d n, double length, double margin) {
  Vec3d move{};
  const auto edge = [&](double share, Vec3d from, Vec3d to) {  // share: of the corner that faces this edge
    const Vec3d along = to - from;
    const double edge_length2 = dot(along, along);
    const double roughly = (share - 1e-4) * length;  // distance from the edge × the edge's length
    if (roughly > 0.0 && roughly * roughly > margin * margin * edge_length2) return;
    const Vec3d inward = cross(n, along) / (length * std::sqrt(edge_length2));
    const double missing = margin - dot(inward, p - from);
    if (missing > 0.0) move = move + inward * std::min(missing, 2.0 * margin);
  };
  edge(1.0 - u - v, v1, v2);
  edge(u, v2, v0);
  edge(v, v0, v1);
  return move;
}

/// Rounds a place at `offset` from the surface to single precision, away from the surface on every axis.
Vec3f roundedAway(Vec3d place, Vec3d normal, double offset) {
  const auto away = [](double value, double direction) {
    const auto rounded = static_cast<float>(value);
    return direction > 0.0 ? std::nextafter(rounded, INFINITY)
                           : direction < 0.0 ? std::nextafter(rounded, -INFINITY) : rounded;
  };
  const Vec3d p = place + normal * offset;
  return {away(p.x, normal.x), away(p.y, normal.y), away(p.z, normal.z)};
}

void faceTheRay(Hit& hit, Vec3d direction) {
  if (dot(hit.normal, direction) > 0.0) hit.normal = -hit.normal;
}

Hit refineTriangle(const BuiltObject& object, std::uint32_t primitive, float u, float v, Vec3d o, Vec3d d) {
  const auto& corners = object.triangles[primitive];
  const Vec3d v0 = object.vertices[corners[0]], v1 = object.vertices[corners[1]], v2 = object.vertices[corners[2]];
  const Vec3d n = cross(v1 - v0, v2 - v0);
  const double length = norm(n);
  Hit hit;
  hit.normal = n / length;
  const double t = dot(hit.normal, v0 - o) / dot(hit.normal, d);
  if (std::isfinite(t)) {
    const Vec3d p = o + d * t;
    hit.position = p - hit.normal * dot(hit.normal, p - v0);
  } else {  // the ray lies in the plane
    hit.position = v0 + (v1 - v0) * static_cast<double>(u) + (v2 - v0) * static_cast<double>(v);
  }
  const double offset = embreeTriangleError(hit.position, v0, v1, v2, n, length) +
                        2.0 * roundingAlong(hit.normal, hit.position) + kSmallestOffset;
  const Vec3d reach = absolute(hit.position);
  const double margin = 4.0 * (offset + kUnitRoundoff * std::max({reach.x, reach.y, reach.z}));
  const Vec3d inside = awayFromEdges(hit.position, static_cast<double>(u), static_cast<double>(v), v0, v1, v2, n, length, margin);
  faceTheRay(hit, d);
  hit.start = roundedAway(hit.position + inside, hit.normal, offset);
  return hit;
}

Hit refineQuadric(const Quadric& quadric, int part, float embree_distance, Vec3d o, Vec3d d) {
  const Vec3d local_o = quadric.toLocal(o - quadric.centre), local_d = quadric.toLocal(d);
  const Crossings at = crossings(quadric, part, local_o, local_d);
  // The same crossing as Embree's, whose ray was rounded; if the exact ray just misses, Embree's.
  const auto approximate = static_cast<double>(embree_distance);
  double t = std::isfinite(at.first) ? at.first : approximate;
  if (std::isfinite(at.second) &&
      (!std::isfinite(at.first) || std::abs(at.second - approximate) < std::abs(t - approximate))) {
    t = at.second;
  }
  const SurfacePoint point = ontoSurface(quadric, part, local_o + local_d * t);
  Hit hit;
  hit.position = quadric.centre + quadric.toScene(point.position);
  hit.normal = quadric.toScene(point.normal);
  faceTheRay(hit, d);
  // Its intersection is computed in double precision: only the start's own rounding counts.
  hit.start = roundedAway(hit.position, hit.normal, 2.0 * roundingAlong(hit.normal, hit.position) + kSmallestOffset);
  return hit;
}

}  // namespace

Hit refine(const Scene::Impl& scene, std::uint32_t object_id, std::uint32_t primitive, float u, float v,
           float embree_distance, Vec3d origin, Vec3d direction) {
  const BuiltObject& object = scene.objects[object_id];
  Hit hit = object.triangles.empty()
                ? refineQuadric(object.quadric, static_cast<int>(u), embree_distance, origin, direction)
                : refineTriangle(object, primitive, u, v, origin, direction);
  hit.distance = norm(hit.position - origin);
  hit.material = static_cast<std::uint32_t>(object.material);
  return hit;
}

}  // namespace toftwin::sim
