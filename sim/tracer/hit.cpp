// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/hit.h"

#include <algorithm>
#include <cmath>

namespace toftwin::sim {
namespace {

constexpr double kUnitRoundoff = 0x1p-24;  // of single precision
/// Where all bounds vanish (a plane through zero), a length that does not count as denormal, even
/// multiplied with a triangle's area.
constexpr double kSmallestOffset = 1e-18;
/// How far a start keeps from edges, in units of the error bound.
constexpr double kEdgeMargin = 4.0;
/// Embree's u and v are wrong by a few 1e-7: this near to an edge they are computed anew.
constexpr double kNearEdge = 1e-4;

Vec3d absolute(Vec3d v) { return {std::abs(v.x), std::abs(v.y), std::abs(v.z)}; }
Vec3d largest(Vec3d a, Vec3d b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }
double largest(Vec3d v) { return std::max({v.x, v.y, v.z}); }

/// Moves along a triangle: `onto` takes a place outside it to its edge, `inside` then keeps it at least
/// `margin` away from its three edges: a ray that starts on an edge could start behind the surface that
/// begins there.
void keepInside(const BuiltObject& object, std::uint32_t primitive, Vec3d p, double margin, Contact& contact) {
  const auto& corners = object.triangles[primitive];
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3d from = object.vertices[corners[i]], along = object.vertices[corners[(i + 1) % 3]] - from;
    const Vec3d inward = cross(contact.normal, along) / norm(along);
    const double height = dot(inward, p - from);
    contact.onto = contact.onto + inward * std::max(0.0, -height);
    contact.inside = contact.inside + inward * std::clamp(margin - height, 0.0, margin);
  }
}

Contact contactOfQuadric(const Quadric& quadric, int part, double embree_distance, Vec3d o, Vec3d d) {
  const Vec3d local_o = quadric.toLocal(o - quadric.centre), local_d = quadric.toLocal(d);
  const Crossings at = crossings(quadric, part, local_o, local_d);
  // The same crossing as Embree's, whose ray was rounded; if the exact ray just misses, Embree's.
  double t = std::isfinite(at.first) ? at.first : embree_distance;
  if (std::isfinite(at.second) &&
      (!std::isfinite(at.first) || std::abs(at.second - embree_distance) < std::abs(t - embree_distance))) {
    t = at.second;
  }
  const SurfacePoint point = ontoSurface(quadric, part, local_o + local_d * t);
  const Vec3d position = quadric.centre + quadric.toScene(point.position);
  Contact contact{.normal = quadric.toScene(point.normal), .level = 0.0, .distance = t, .offset = 0.0, .onto = {}, .inside = {}};
  contact.level = dot(contact.normal, position);
  // Its intersection is computed in double precision: only the start's own rounding counts.
  contact.offset = 2.0 * kUnitRoundoff * dot(absolute(contact.normal), absolute(position)) + kSmallestOffset;
  return contact;
}

}  // namespace

/// The offset bounds the error of Embree's robust triangle test, as a distance from the triangle's
/// plane, for a ray that starts on the triangle. Let m be the triangle's extent per axis. v_i − O is
/// rounded once (error u m), an edge is the difference of two (|e| ≤ m, error 3um), a component of N
/// that of two products (2 · 2 · 3u m_j m_k carried on and 6u m_j m_k of its own), and T a dot product:
///   |ΔT| ≤ 54 u m_x m_y m_z + 4 u Σ m_i |N_i|,    distance = |ΔT| / |N|
/// Embree's corners are ours rounded, which moves its plane by up to u Σ |n_i| P_i more, P the largest
/// |coordinate| per axis; and so much again twice for rounding the start.
TrianglePlane planeOf(Vec3d v0, Vec3d v1, Vec3d v2) {
  const Vec3d n = cross(v1 - v0, v2 - v0);
  const double length = norm(n);
  const Vec3d reach = largest(largest(absolute(v0), absolute(v1)), absolute(v2));
  const Vec3d m = largest(largest(absolute(v1 - v0), absolute(v2 - v1)), absolute(v0 - v2)) + reach * (2.0 * kUnitRoundoff);
  TrianglePlane plane;
  plane.normal = n / length;
  plane.level = dot(plane.normal, v0);
  const double offset = kUnitRoundoff * (54.0 * m.x * m.y * m.z / length + dot(4.0 * m + 3.0 * reach, absolute(plane.normal)));
  plane.offset = static_cast<float>(offset * (1.0 + 0x1p-20)) + static_cast<float>(kSmallestOffset);
  const double margin = kEdgeMargin * (offset + kUnitRoundoff * largest(reach));
  plane.margin = static_cast<float>(margin);
  // u or v at the margin: margin / height over the longest edge
  plane.margin_share = static_cast<float>(margin * largest(Vec3d{norm(v1 - v0), norm(v2 - v1), norm(v0 - v2)}) / length);
  return plane;
}

Contact contactOf(const BuiltObject& object, std::uint32_t primitive, float u, float v, float embree_distance, Vec3d o,
                  Vec3d d) {
  if (object.planes.empty()) {
    return contactOfQuadric(object.quadric, static_cast<int>(u), static_cast<double>(embree_distance), o, d);
  }
  const TrianglePlane& plane = object.planes[primitive];
  Contact contact{.normal = plane.normal, .level = plane.level, .distance = 0.0,
                  .offset = static_cast<double>(plane.offset), .onto = {}, .inside = {}};
  const double per_slope = 1.0 / dot(plane.normal, d);
  contact.distance = (plane.level - dot(plane.normal, o)) * per_slope;
  // A ray within the plane has no crossing; Embree's distance is then as good as any.
  if (!std::isfinite(contact.distance)) contact.distance = static_cast<double>(embree_distance);
  // Embree's ray starts up to about a margin beside the exact one, and meets the plane beside it by
  // that over the sine of the angle between ray and plane.
  const double near_edge = kNearEdge + static_cast<double>(plane.margin_share) * (1.0 + std::abs(per_slope));
  if (static_cast<double>(std::min({u, v, 1.0f - u - v})) < near_edge) {
    keepInside(object, primitive, o + d * contact.distance, static_cast<double>(plane.margin), contact);
  }
  return contact;
}

}  // namespace toftwin::sim
