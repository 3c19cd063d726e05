// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/mirrored_light.h"

#include <algorithm>
#include <cmath>

#include "sim/tracer/cast.h"
#include "sim/tracer/hit.h"
#include "sim/tracer/path.h"
#include "sim/tracer/shade.h"
#include "sim/tracer/special.h"

namespace toftwin::sim {
namespace {

constexpr std::size_t kMostPlanes = 12;  ///< of one object; a box has six
constexpr double kSamePlane = 1e-6;      ///< of normals and, in metres, of levels

bool isMirror(const Scene::Impl& scene, std::size_t object) {
  const int special = scene.rows[object].material.special;
  return special != 0 &&
         std::holds_alternative<bsdf::Mirror>(scene.models[static_cast<std::size_t>(special - 1)]);
}

bool isSame(const MirrorPlane& a, const MirrorPlane& b) {
  const double facing = dot(a.normal, b.normal) > 0.0 ? 1.0 : -1.0;
  return norm(a.normal - b.normal * facing) < kSamePlane && std::abs(a.level - facing * b.level) < kSamePlane;
}

/// In the object's frame; none of one that is not flat.
std::vector<MirrorPlane> planesOfObject(const BuiltObject& object, std::size_t index) {
  std::vector<MirrorPlane> planes;
  if (object.triangles.empty()) {
    if (object.quadric.kind != Quadric::Kind::Disc) return {};
    const Vec3d normal = object.quadric.axes[2];
    return {{index, normal, dot(normal, object.quadric.centre)}};
  }
  for (const TrianglePlane& triangle : object.planes) {
    const MirrorPlane plane{index, triangle.normal, triangle.level};
    if (std::ranges::any_of(planes, [&](const MirrorPlane& known) { return isSame(known, plane); })) continue;
    if (planes.size() == kMostPlanes) return {};
    planes.push_back(plane);
  }
  return planes;
}

Vec3d mirrored(const MirrorPlane& plane, Vec3d p) {
  return p - plane.normal * (2.0 * (dot(plane.normal, p) - plane.level));
}

PlacedEmitter imageOf(const PlacedEmitter& emitter, const MirrorPlane& plane) {
  PlacedEmitter image = emitter;
  image.position = mirrored(plane, emitter.position);
  image.axis = emitter.axis - plane.normal * (2.0 * dot(plane.normal, emitter.axis));
  return image;
}

/// Rays from the hits towards the image: what they meet first.
void castTowards(const Tracing& tracing, const Hits& hits, Vec3d image, const Lanes<int>& valid,
                 RTCRayHit16& rays) {
  Vec3Lanes places;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    places.x[i] = image.x, places.y[i] = image.y, places.z[i] = image.z;
    rays.hit.geomID[i] = rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  setShadowRays(hits, places, rays.ray);
  castRays(tracing.scene, valid.v, rays, false);
}

/// The packet that went from the hits to the image.
void startTowards(const Packet& packet, const Hits& hits, Vec3d image, Packet& to) {
  to = packet;
  to.origin = hits.position;
  to.start = hits.start;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const Vec3d way = image - at(hits.position, i), direction = way / norm(way);
    to.direction.x[i] = direction.x, to.direction.y[i] = direction.y, to.direction.z[i] = direction.z;
  }
}

}  // namespace

std::vector<MirrorPlane> mirrorPlanes(const Scene::Impl& scene) {
  std::vector<MirrorPlane> all;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    if (!isMirror(scene, i)) continue;
    const Standing* standing = scene.rows[i].standing;
    for (MirrorPlane plane : planesOfObject(scene.objects[i], i)) {
      if (standing != nullptr) {
        plane.normal = standing->scene_from_object.rotate(plane.normal);
        plane.level += dot(plane.normal, standing->scene_from_object.translation_m);
      }
      all.push_back(plane);
    }
  }
  return all;
}

bool areAllMirrorsFlat(const Scene::Impl& scene) {
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    if (isMirror(scene, i) && planesOfObject(scene.objects[i], i).empty()) return false;
  return true;
}

std::vector<MirroredEmitter> mirroredEmitters(const Scene::Impl& scene,
                                              std::span<const PlacedEmitter> emitters) {
  std::vector<MirroredEmitter> all;
  if (scene.is_matt) return all;
  for (const MirrorPlane& plane : mirrorPlanes(scene)) {
    for (const PlacedEmitter& emitter : emitters)
      if (!emitter.is_disc) all.push_back({plane, emitter.position, imageOf(emitter, plane)});
  }
  return all;
}

void throughMirror(const Tracing& tracing, const Packet& packet, const Hits& hits,
                   const MirroredEmitter& mirror, DirectLight& light) {
  const auto& [plane, emitter, image] = mirror;
  RTCRayHit16 rays;
  castTowards(tracing, hits, image.position, light.valid, rays);
  Packet to;
  startTowards(packet, hits, image.position, to);
  // A ray that meets nothing, or something else, has no place on the mirror, and no texture there.
  for (std::size_t i = 0; i < kLaneCount; ++i)
    to.valid[i] = light.valid[i] != 0 && rays.hit.geomID[i] == plane.object ? -1 : 0;
  Hits on_mirror;
  findHits(tracing.scene, to, rays, on_mirror);
  applyTextures(tracing.scene, rays, to, on_mirror);
  const double side = dot(plane.normal, emitter) - plane.level;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const Vec3d p = at(on_mirror.position, i);
    const double reach = 1e-6 * (1.0 + std::abs(plane.level) + on_mirror.distance[i]);
    const bool is_there = to.valid[i] != 0 &&
                          std::abs(dot(plane.normal, p) - plane.level) < reach &&
                          dot(at(on_mirror.normal, i), plane.normal) * side > 0.0;
    if (is_there) {
      light.weight[i] *= on_mirror.albedo[i];
      continue;
    }
    light.valid[i] = 0;
    light.weight[i] = 0.0f;
  }
  if (!isAny(light.valid)) return;
  Vec3Lanes places;
  for (std::size_t i = 0; i < kLaneCount; ++i)
    places.x[i] = emitter.x, places.y[i] = emitter.y, places.z[i] = emitter.z;
  shadowRays(tracing, on_mirror, places, light, false);
}

}  // namespace toftwin::sim
