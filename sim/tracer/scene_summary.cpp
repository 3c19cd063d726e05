// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/scene_summary.h"

#include <algorithm>
#include <cmath>

#include "sim/tracer/mesh.h"
#include "sim/tracer/scene_meshes.h"

namespace toftwin::sim {
namespace {

Vec3d lesser(Vec3d a, Vec3d b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
Vec3d greater(Vec3d a, Vec3d b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }

/// Points whose box is that of the object, in its own frame and scaled; a round thing's are the corners of its box.
std::vector<Vec3d> pointsOf(const ObjectSpec& spec, const TriangleMesh* mesh) {
  std::vector<Vec3d> points;
  if (mesh != nullptr) {
    points = mesh->vertices;
  } else {
    const double radius = spec.radius.in(metre), height = spec.height.in(metre);
    const bool is_round = spec.shape == Shape::Sphere || spec.shape == Shape::Cylinder || spec.shape == Shape::Disc;
    const double z = spec.shape == Shape::Sphere     ? 2.0 * radius
                     : spec.shape == Shape::Cylinder ? height
                     : spec.shape == Shape::Box      ? spec.size_m[2]
                                                     : 0.0;
    points = is_round ? boxMesh(2.0 * radius, 2.0 * radius, z).vertices : boxMesh(spec.size_m[0], spec.size_m[1], z).vertices;
  }
  for (Vec3d& p : points) p = p * spec.scale;
  return points;
}

std::size_t trianglesOf(const PlacedObject& object) {
  if (object.triangles) return object.triangles->triangles.size();
  if (object.spec.shape == Shape::Box) return 12;
  return object.spec.shape == Shape::Rectangle ? 2 : 0;
}

}  // namespace

std::size_t SceneSummary::triangles() const {
  std::size_t sum = 0;
  for (const ObjectSummary& object : objects) sum += object.triangles;
  return sum;
}

Vec3d SceneSummary::lower() const {
  Vec3d all = objects.front().lower_m;
  for (const ObjectSummary& object : objects) all = lesser(all, object.lower_m);
  return all;
}

Vec3d SceneSummary::upper() const {
  Vec3d all = objects.front().upper_m;
  for (const ObjectSummary& object : objects) all = greater(all, object.upper_m);
  return all;
}

Result<SceneSummary> summarise(const std::filesystem::path& file, const SceneLoading& how) {
  auto scene = loadSceneFile(file, how);
  if (!scene) return scene.error();
  auto notes = readMeshes(*scene, how);
  if (!notes) return notes.error();
  SceneSummary summary;
  summary.notes = *std::move(notes);
  const AmbientSpec& ambient = scene->spec.ambient;
  summary.up = normalised(vec3Of(ambient.up));
  const Vec3d ahead = vec3Of(ambient.ahead);
  summary.ahead = normalised(ahead - summary.up * dot(summary.up, ahead));
  std::vector<bool> is_used(scene->spec.materials.size(), false);
  for (const PlacedObject& object : scene->objects) {
    ObjectSummary& one = summary.objects.emplace_back();
    one.name = object.spec.name;
    one.shape = object.spec.shape;
    one.material = scene->spec.materials[*object.material].name;
    one.triangles = trianglesOf(object);
    one.moves = !object.motion.isStill();
    is_used[*object.material] = true;
    one.lower_m = {INFINITY, INFINITY, INFINITY};
    one.upper_m = -one.lower_m;
    for (const Vec3d& p : pointsOf(object.spec, object.triangles.get())) {
      const Vec3d at = (object.world_from_object * Point<Object>{p}).m;
      one.lower_m = lesser(one.lower_m, at);
      one.upper_m = greater(one.upper_m, at);
    }
  }
  for (std::size_t i = 0; i < is_used.size(); ++i) {
    if (is_used[i]) summary.materials.push_back(scene->spec.materials[i]);
  }
  return summary;
}

}  // namespace toftwin::sim
