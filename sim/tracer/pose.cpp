// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/pose.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/tracer/emitter.h"
#include "sim/tracer/hit.h"
#include "sim/tracer/random.h"

namespace toftwin::sim {
namespace {

constexpr double kHalfUlp = 0x1p-24;  // of single precision

/// Stands for a quadric among the triangles: every ray counts as next to its edge, where the tracer
/// looks more closely.
constexpr TrianglePlane kNoTriangle{
    .normal = {0, 0, 1}, .level = 0.0, .offset = 0.0f, .margin = 0.0f, .margin_share = INFINITY};

double largestSize(Vec3d v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

/// cast.cpp takes a ray that starts at p into an object's frame with Rᵀ (p − t), in single precision. Let
/// D ≥ |p − t| for p on the object. t is rounded and the difference again: u (|t|∞ + D) per component. R's
/// entries are rounded, and a component of the result sums three products: 4 u D more. As a distance:
///   √3 (√3 u (|t|∞ + D) + 4 u D) < 10 u D + 3 u |t|∞,    here with a fifth more.
double blurOf(double reach, Vec3d translation) {
  return kHalfUlp * (12.0 * std::sqrt(3.0) * reach + 4.0 * largestSize(translation));
}

}  // namespace

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

double reachOf(const BuiltObject& own) {
  double reach = own.quadric.radius + own.quadric.half_height;
  for (const Vec3d& v : own.vertices) reach = std::max(reach, largestSize(v));
  return reach;
}

namespace {

Vec3d middleOf(const RTCBounds& box) {
  const auto d = [](float v) { return static_cast<double>(v); };
  return Vec3d{d(box.lower_x) + d(box.upper_x), d(box.lower_y) + d(box.upper_y), d(box.lower_z) + d(box.upper_z)} / 2.0;
}

}  // namespace

double radiusOf(const BuiltObject& own, const RTCBounds& box) {
  if (own.vertices.empty()) return std::hypot(own.quadric.radius, own.quadric.half_height);
  const Vec3d middle = middleOf(box);
  double radius = 0.0;
  for (const Vec3d& v : own.vertices) radius = std::max(radius, norm(v - middle));
  return radius;
}

Hiding hidesOf(RTCScene mover, const RTCBounds& box, double radius) {
  constexpr std::uint32_t kLines = 4096, kEnough = 1024;
  const auto d = [](float v) { return static_cast<double>(v); };
  const Vec3d middle = middleOf(box);
  const PixelKey key = pixelKey(seedKey(0), 0, 0);
  std::vector<std::pair<double, bool>> lines;  // how far from the middle, and whether it meets anything
  for (std::uint32_t i = 0; i < kLines; ++i) {
    const RandomPair way = randomPair(key, i, 0), beside = randomPair(key, i, 1);
    const auto point = [](double along, double turns) {
      const double r = std::sqrt(std::max(0.0, 1.0 - along * along)), angle = 2.0 * std::numbers::pi * turns;
      return Vec3d{r * std::cos(angle), r * std::sin(angle), along};
    };
    const Vec3d direction = point(1.0 - 2.0 * d(way.u), d(way.v));
    const Basis across = basisAround(direction);
    const double away = radius * std::sqrt(d(beside.u));
    const Vec3d off = point(0.0, d(beside.v)) * away;
    const Vec3d from = middle + across.x * off.x + across.y * off.y - direction * (1.01 * radius);
    RTCRay ray{};
    ray.org_x = static_cast<float>(from.x), ray.org_y = static_cast<float>(from.y),
    ray.org_z = static_cast<float>(from.z);
    ray.dir_x = static_cast<float>(direction.x), ray.dir_y = static_cast<float>(direction.y),
    ray.dir_z = static_cast<float>(direction.z);
    ray.tfar = static_cast<float>(2.02 * radius);
    ray.mask = 0xffffffffu;
    embree::occluded(mover, ray);
    lines.emplace_back(away, ray.tfar < 0.0f);
  }
  std::ranges::sort(lines);
  const auto met = [&](auto from) {
    return static_cast<double>(std::count_if(from, lines.end(), [](const auto& line) { return line.second; }));
  };
  const auto passes = std::ranges::find(lines, false, &std::pair<double, bool>::second);
  const bool has_core = passes - lines.begin() >= kEnough;
  const auto first = has_core ? passes : lines.begin();
  return {.all = met(lines.begin()) / kLines,
          .core = !has_core ? 0.0 : passes == lines.end() ? radius : passes->first,
          .rim = first == lines.end() ? 0.0 : met(first) / static_cast<double>(lines.end() - first)};
}

void placeMovers(Scene::Impl& scene, const Scene::Impl& loaded, Duration time) {
  scene.rows.clear();
  for (const BuiltObject& object : scene.objects) {
    scene.rows.push_back({.planes = object.planes.empty() ? &kNoTriangle : object.planes.data(),
                          .material = scene.materials[object.material]});
  }
  scene.rows.push_back({.planes = &kNoTriangle, .material = {.albedo = 0.0f}});
  scene.poses.reserve(loaded.movers.size());  // rows point to them
  for (const Mover& mover : loaded.movers) {
    Standing& standing = scene.poses.emplace_back();
    standing.embree = mover.embree;
    standing.tree = mover.tree.get();
    standing.object = static_cast<std::uint32_t>(mover.object);
    Transform<World, Object>& pose = standing.scene_from_object = poseAt(mover.motion, mover.start, time);
    pose.translation_m = pose.translation_m - loaded.origin_in_world;
    standing.axes = {pose.rotate({1, 0, 0}), pose.rotate({0, 1, 0}), pose.rotate({0, 0, 1})};
    standing.blur = blurOf(mover.reach, pose.translation_m);
    RTCBounds box;
    rtcGetSceneBounds(mover.embree, &box);
    standing.lower = {box.lower_x, box.lower_y, box.lower_z};
    standing.upper = {box.upper_x, box.upper_y, box.upper_z};
    standing.radius = mover.radius;
    standing.hides = mover.hides;
    standing.is_paired = loaded.objects[mover.object].get().is_paired;
    scene.rows[mover.object].standing = &standing;
  }
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
  posed->notes = loaded->notes;
  posed->numbers = loaded->numbers;
  posed->foreign_emitters = loaded->foreign_emitters;
  posed->ambient_radiance = loaded->ambient_radiance;
  posed->is_matt = loaded->is_matt;
  posed->has_glass = loaded->has_glass;
  posed->origin_in_world = loaded->origin_in_world;
  posed->diagonal_m = loaded->diagonal_m;
  posed->device = loaded->device;
  posed->still = loaded->still;
  posed->still_pairs = loaded->still_pairs;
  posed->still_few = loaded->still_few;
  placeMovers(*posed, *loaded, time);
  return Scene{std::move(posed)};
}

}  // namespace toftwin::sim
