// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/pose.h"

#include <algorithm>
#include <cmath>

#include "sim/tracer/hit.h"
#include "sim/tracer/scene_embree.h"

namespace toftwin::sim {
namespace {

constexpr double kUnitRoundoff = 0x1p-24;  // of single precision

/// Stands for a quadric among the triangles: every ray counts as next to its edge, where the tracer
/// looks more closely.
constexpr TrianglePlane kNoTriangle{
    .normal = {0, 0, 1}, .level = 0.0, .offset = 0.0f, .margin = 0.0f, .margin_share = INFINITY};

double largest(Vec3d v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

/// Embree takes a ray into an instance's frame with M⁻¹ p − M⁻¹ t, in single precision. M's entries are
/// rounded (u), its inverse is made of products of two of them over a determinant near 1 (8u), and a
/// component of the result sums three products and one more term (4u): per component below
/// 16 u (|p|₁ + |t|₁), thus below 48 u (|p|∞ + |t|∞) √3 as a distance, p on the object and t its place.
double blurOf(double reach, Vec3d translation) {
  return 48.0 * std::sqrt(3.0) * kUnitRoundoff * (reach + 2.0 * largest(translation));
}

}  // namespace

void fillRows(Scene::Impl& scene) {
  scene.rows.clear();
  for (const BuiltObject& object : scene.objects) {
    scene.rows.push_back({.planes = object.planes.empty() ? &kNoTriangle : object.planes.data(),
                          .material = scene.materials[object.material]});
  }
  scene.rows.push_back({.planes = &kNoTriangle, .material = {.albedo = 0.0f}});
}

void moveInto(BuiltObject& object, const Transform<World, Object>& scene_from_object) {
  for (Vec3d& v : object.vertices) v = (scene_from_object * Point<Object>{v}).m;
  Quadric& quadric = object.quadric;
  quadric.centre = scene_from_object.translation_m;
  quadric.axes = {scene_from_object.rotate({1, 0, 0}), scene_from_object.rotate({0, 1, 0}),
                  scene_from_object.rotate({0, 0, 1})};
}

void addPlanes(BuiltObject& object) {
  object.planes.reserve(object.triangles.size());
  for (const auto& [a, b, c] : object.triangles) {
    object.planes.push_back(planeOf(object.vertices[a], object.vertices[b], object.vertices[c]));
  }
}

BuiltObject posedCopy(const BuiltObject& own, const Transform<World, Object>& scene_from_object) {
  BuiltObject posed = own;
  double reach = own.quadric.radius + own.quadric.half_height;
  for (const Vec3d& v : own.vertices) reach = std::max(reach, largest(v));
  const double blur = blurOf(reach, scene_from_object.translation_m);
  moveInto(posed, scene_from_object);
  posed.quadric.blur = blur;
  for (std::size_t i = 0; i < posed.planes.size(); ++i) {
    TrianglePlane& plane = posed.planes[i];
    plane.normal = normalised(scene_from_object.rotate(plane.normal));
    plane.level = dot(plane.normal, posed.vertices[posed.triangles[i][0]]);
    const double share_of_margin =
        static_cast<double>(plane.margin_share) / static_cast<double>(plane.margin);
    plane.offset += static_cast<float>(blur);
    plane.margin += static_cast<float>(4.0 * blur);
    plane.margin_share = static_cast<float>(share_of_margin * static_cast<double>(plane.margin));
  }
  return posed;
}

bool Scene::moves() const { return !impl_->movers.empty() || impl_->loaded != nullptr; }

Scene Scene::at(Duration time) const {
  if (!moves()) return *this;
  const std::shared_ptr<const Impl> loaded = impl_->loaded != nullptr ? impl_->loaded : impl_;
  auto posed = std::make_shared<Impl>();
  posed->loaded = loaded;
  posed->id = loaded->id;
  posed->materials = loaded->materials;
  posed->models = loaded->models;
  posed->textures = loaded->textures;
  posed->environment = loaded->environment;
  posed->objects = loaded->objects;
  posed->foreign_emitters = loaded->foreign_emitters;
  posed->ambient_radiance = loaded->ambient_radiance;
  posed->is_matt = loaded->is_matt;
  posed->has_glass = loaded->has_glass;
  posed->origin_in_world = loaded->origin_in_world;
  posed->diagonal_m = loaded->diagonal_m;
  posed->device = loaded->device;
  posed->still = loaded->still;
  std::vector<Transform<World, Object>> poses;
  for (const Mover& mover : loaded->movers) {
    Transform<World, Object>& pose = poses.emplace_back(poseAt(mover.motion, mover.start, time));
    pose.translation_m = pose.translation_m - loaded->origin_in_world;
    posed->objects[mover.object] = std::cref(posed->owned.emplace_back(posedCopy(mover.own, pose)));
  }
  fillRows(*posed);
  posed->embree = makeInstances(*loaded, poses);
  return Scene{std::move(posed)};
}

}  // namespace toftwin::sim
