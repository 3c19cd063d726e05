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
constexpr float kNearEdge = 1e-4f;

Vec3d absolute(Vec3d v) { return {std::abs(v.x), std::abs(v.y), std::abs(v.z)}; }
Vec3d largest(Vec3d a, Vec3d b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }
double largest(Vec3d v) { return std::max({v.x, v.y, v.z}); }

/// Where a ray meets a primitive. The hit is origin + distance · direction, moved onto the plane
/// normal · p = level and by `onto`.
struct Contact {
  Vec3d normal;     ///< geometric, unit; of either side
  double level;
  double distance;
  double offset;    ///< how far from the surface rays that leave must start
  // Not zero only next to an edge of a triangle:
  Vec3d onto;       ///< from outside onto the edge
  Vec3d inside;     ///< away from the edge, for rays that leave
};

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

Contact contactOfQuadric(const Quadric& quadric, double blur, int part, double embree_distance, Vec3d o, Vec3d d) {
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
  contact.offset = 2.0 * kUnitRoundoff * dot(absolute(contact.normal), absolute(position)) + blur + kSmallestOffset;
  return contact;
}

/// A triangle that the ray meets next to an edge.
Contact contactAtEdge(const BuiltObject& object, double blur, std::uint32_t primitive, double distance, Vec3d o,
                      Vec3d d) {
  const TrianglePlane& plane = object.planes[primitive];
  Contact contact{.normal = plane.normal, .level = plane.level, .distance = distance,
                  .offset = static_cast<double>(plane.offset) + blur, .onto = {}, .inside = {}};
  const double margin = static_cast<double>(plane.margin) + kEdgeMargin * blur;
  keepInside(object, primitive, o + d * distance, margin, contact);
  return contact;
}

/// A plane of a moving object, in the scene; its bounds count what taking rays to the object rounds.
TrianglePlane placed(const TrianglePlane& own, const Standing& standing) {
  TrianglePlane plane = own;
  const auto& [a, b, c] = standing.axes;
  plane.normal = a * own.normal.x + b * own.normal.y + c * own.normal.z;
  plane.level = own.level + dot(plane.normal, standing.scene_from_object.translation_m);
  plane.offset += static_cast<float>(standing.blur);
  plane.margin += static_cast<float>(kEdgeMargin * standing.blur);
  plane.margin_share = own.margin_share / own.margin * plane.margin;
  return plane;
}

/// The same for a contact that was found in the object's frame.
Contact placed(Contact contact, const Standing& standing) {
  const Transform<World, Object>& pose = standing.scene_from_object;
  contact.normal = pose.rotate(contact.normal);
  contact.level += dot(contact.normal, pose.translation_m);
  contact.onto = pose.rotate(contact.onto);
  contact.inside = pose.rotate(contact.inside);
  return contact;
}

/// Rounds to single precision, away from the surface whose normal component is given: moved by one unit
/// in the last place first, twice what rounding can take back.
TOFTWIN_INLINE float roundedAway(double value, double normal) {
  return static_cast<float>(value + std::copysign(std::abs(value) * 0x1p-23, normal));
}

/// Puts a contact into a lane. `placeOnPlanes` does the same, but for the moves at edges.
void place(const Contact& contact, Vec3d o, Vec3d d, std::size_t i, Hits& hits) {
  const Vec3d beside = o + d * contact.distance;
  const Vec3d p = beside - contact.normal * (dot(contact.normal, beside) - contact.level) + contact.onto;
  const Vec3d n = dot(contact.normal, d) > 0.0 ? -contact.normal : contact.normal;
  const Vec3d away = p + contact.inside + n * contact.offset;
  hits.normal.x[i] = n.x;
  hits.normal.y[i] = n.y;
  hits.normal.z[i] = n.z;
  hits.position.x[i] = p.x;
  hits.position.y[i] = p.y;
  hits.position.z[i] = p.z;
  hits.distance[i] = contact.distance;
  hits.start.x[i] = roundedAway(away.x, n.x);
  hits.start.y[i] = roundedAway(away.y, n.y);
  hits.start.z[i] = roundedAway(away.z, n.z);
}

/// The planes of the triangles that sixteen rays met, and how near to an edge a ray counts as next to it.
struct PlaneLanes {
  Vec3Lanes normal;
  Lanes<double> level;
  Lanes<float> offset, margin_share;
};

bool isMissed(const RTCRayHit16& rays, std::size_t i) { return rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID; }

/// Of a moving object it is made in `room`.
TOFTWIN_INLINE const TrianglePlane& planeIn(const ObjectRow& row, unsigned primitive, TrianglePlane& room) {
  const TrianglePlane& own = row.planes[primitive];
  if (row.standing != nullptr) room = placed(own, *row.standing);
  return row.standing == nullptr ? own : room;
}

TOFTWIN_INLINE void takeLane(const ObjectRow& row, const TrianglePlane& plane, std::size_t i, PlaneLanes& planes, Hits& hits) {
  planes.normal.x[i] = plane.normal.x;
  planes.normal.y[i] = plane.normal.y;
  planes.normal.z[i] = plane.normal.z;
  planes.level[i] = plane.level;
  planes.offset[i] = plane.offset;
  planes.margin_share[i] = plane.margin_share;
  hits.albedo[i] = row.material.albedo;
  hits.emission[i] = row.material.emission;
  hits.shape_a[i] = row.material.a;
  hits.shape_b[i] = row.material.b;
}

/// The same triangle for all lanes: what the rays of neighbouring pixels mostly meet on walls.
TOFTWIN_VECTOR
bool meetOneTriangle(const Scene::Impl& scene, const RTCRayHit16& rays, PlaneLanes& planes, Hits& hits) {
  const unsigned object = rays.hit.geomID[0], primitive = rays.hit.primID[0];
  unsigned differ = 0;
  for (std::size_t i = 0; i < kLaneCount; ++i) differ |= (rays.hit.geomID[i] ^ object) | (rays.hit.primID[i] ^ primitive);
  if (differ != 0 || object == RTC_INVALID_GEOMETRY_ID) return false;
  const ObjectRow row = scene.rows[object];
  TrianglePlane room;
  const TrianglePlane plane = planeIn(row, primitive, room);
  for (std::size_t i = 0; i < kLaneCount; ++i) takeLane(row, plane, i, planes, hits);
  return true;
}

void gather(const Scene::Impl& scene, const RTCRayHit16& rays, PlaneLanes& planes, Hits& hits) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    if (isMissed(rays, i)) continue;
    const ObjectRow& row = scene.rows[rays.hit.geomID[i]];
    const auto* plane = reinterpret_cast<const char*>(&row.planes[rays.hit.primID[i]]);
    __builtin_prefetch(plane);
    __builtin_prefetch(plane + sizeof(TrianglePlane) - 1);
  }
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const bool is_missed = isMissed(rays, i);
    const ObjectRow& row = is_missed ? scene.rows.back() : scene.rows[rays.hit.geomID[i]];
    TrianglePlane room;
    takeLane(row, planeIn(row, is_missed ? 0 : rays.hit.primID[i], room), i, planes, hits);
  }
}

/// Meets each ray with its plane. Which lanes are next to an edge, or on no triangle at all, goes to
/// `by_hand`.
TOFTWIN_VECTOR
bool placeOnPlanes(const Packet& packet, const RTCRayHit16& rays, const PlaneLanes& planes, Hits& hits, Lanes<int>& by_hand) {
  int any = 0;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const double dx = packet.direction.x[i], dy = packet.direction.y[i], dz = packet.direction.z[i];
    const double ox = packet.origin.x[i], oy = packet.origin.y[i], oz = packet.origin.z[i];
    const double nx = planes.normal.x[i], ny = planes.normal.y[i], nz = planes.normal.z[i], level = planes.level[i];
    const double slope = nx * dx + ny * dy + nz * dz, per_slope = perNumber(slope);
    const double exact = (level - (nx * ox + ny * oy + nz * oz)) * per_slope;
    // A ray within the plane has no crossing; Embree's distance is then as good as any.
    const double t = std::abs(exact) < 1e300 ? exact : static_cast<double>(rays.ray.tfar[i]);
    // Embree's ray starts up to about a margin beside the exact one, and meets the plane beside it by
    // that over the sine of the angle between ray and plane.
    const float u = rays.hit.u[i], v = rays.hit.v[i], w = 1.0f - u - v, least = u < v ? u : v;
    const float near_edge = kNearEdge + planes.margin_share[i] * (1.0f + static_cast<float>(std::abs(per_slope)));
    by_hand[i] = ((least < w ? least : w) < near_edge) & (packet.valid[i] != 0) ? -1 : 0;
    any |= by_hand[i];
    double px = ox + t * dx, py = oy + t * dy, pz = oz + t * dz;
    const double above = nx * px + ny * py + nz * pz - level;
    px -= above * nx;
    py -= above * ny;
    pz -= above * nz;
    const double side = slope > 0.0 ? -1.0 : 1.0, offset = static_cast<double>(planes.offset[i]);
    const double sx = nx * side, sy = ny * side, sz = nz * side;
    hits.distance[i] = t;
    hits.position.x[i] = px;
    hits.position.y[i] = py;
    hits.position.z[i] = pz;
    hits.normal.x[i] = sx;
    hits.normal.y[i] = sy;
    hits.normal.z[i] = sz;
    hits.start.x[i] = roundedAway(px + offset * sx, sx);
    hits.start.y[i] = roundedAway(py + offset * sy, sy);
    hits.start.z[i] = roundedAway(pz + offset * sz, sz);
  }
  return any != 0;
}

}  // namespace

Vec3f startOnOtherSide(const Hits& hits, std::size_t i) {
  const Vec3d n{hits.normal.x[i], hits.normal.y[i], hits.normal.z[i]};
  const Vec3d start{static_cast<double>(hits.start.x[i]), static_cast<double>(hits.start.y[i]), static_cast<double>(hits.start.z[i])};
  const Vec3d position{hits.position.x[i], hits.position.y[i], hits.position.z[i]};
  const Vec3d other = start - n * (2.0 * dot(n, start - position));
  return {roundedAway(other.x, -n.x), roundedAway(other.y, -n.y), roundedAway(other.z, -n.z)};
}

void turnToOtherSide(Hits& hits, std::size_t i) {
  const Vec3f start = startOnOtherSide(hits, i);
  hits.start.x[i] = start.x;
  hits.start.y[i] = start.y;
  hits.start.z[i] = start.z;
  hits.normal.x[i] = -hits.normal.x[i];
  hits.normal.y[i] = -hits.normal.y[i];
  hits.normal.z[i] = -hits.normal.z[i];
}

/// The offset bounds the error of Embree's robust triangle test (and of few_triangles.cpp's, which errs less), as a
/// distance from the triangle's plane, for a ray that starts on the triangle. Let m be the triangle's extent per axis. v_i − O is
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

namespace {

/// Quadrics, and triangles next to their edges; in the object's frame if it moves.
Contact contactByHand(const Scene::Impl& scene, const Packet& packet, const RTCRayHit16& rays, double distance,
                      std::size_t i) {
  const BuiltObject& object = scene.objects[rays.hit.geomID[i]];
  const Standing* standing = scene.rows[rays.hit.geomID[i]].standing;
  Vec3d o = at(packet.origin, i), d = at(packet.direction, i);
  if (standing != nullptr) {
    const Transform<Object, World> object_from_scene = standing->scene_from_object.inverse();
    o = (object_from_scene * Point<World>{o}).m;
    d = object_from_scene.rotate(d);
  }
  const double blur = standing != nullptr ? standing->blur : 0.0;
  const Contact contact =
      object.planes.empty()
          ? contactOfQuadric(object.quadric, blur, static_cast<int>(rays.hit.u[i]),
                             static_cast<double>(rays.ray.tfar[i]), o, d)
          : contactAtEdge(object, blur, rays.hit.primID[i], distance, o, d);
  return standing != nullptr ? placed(contact, *standing) : contact;
}

}  // namespace

void findHits(const Scene::Impl& scene, const Packet& packet, const RTCRayHit16& rays, Hits& hits) {
  PlaneLanes planes;
  Lanes<int> by_hand;
  if (!meetOneTriangle(scene, rays, planes, hits)) gather(scene, rays, planes, hits);
  if (!placeOnPlanes(packet, rays, planes, hits, by_hand)) return;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    if (by_hand[i] == 0 || isMissed(rays, i)) continue;
    place(contactByHand(scene, packet, rays, hits.distance[i], i), at(packet.origin, i), at(packet.direction, i), i, hits);
  }
}

}  // namespace toftwin::sim
