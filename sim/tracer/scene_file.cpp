// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/scene_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "protocol/settings/settings.h"

namespace toftwin::sim {
namespace {

using settings::Table;

Transform<World, Object> poseOf(const ObjectSpec& object, bool from_euler) {
  Transform<World, Object> pose;
  if (from_euler) {
    const auto turn = [&](Vec3d axis, double angle_deg) {
      return rotation<World, World>(axis, (angle_deg * degree).in(radian));
    };
    const Transform<World, World> all = turn({0, 0, 1}, object.euler_deg[2]) *
                                        turn({0, 1, 0}, object.euler_deg[1]) *
                                        turn({1, 0, 0}, object.euler_deg[0]);
    pose.rotation_wxyz = all.rotation_wxyz;
  } else {
    const auto& q = object.rotation_wxyz;
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (std::size_t i = 0; i < 4; ++i) pose.rotation_wxyz[i] = q[i] / length;
  }
  const auto& p = object.position_m;
  pose.translation_m = {p[0], p[1], p[2]};
  return pose;
}

/// Complains about a size that the shape needs and that is zero.
void checkSizes(Table& table, const ObjectSpec& object) {
  const auto positive = [&](const char* key, double value) {
    if (value <= 0.0) table.complain(key, "must be greater than 0 for this shape");
  };
  switch (object.shape) {
    case Shape::Box:
      positive("size_m", *std::min_element(object.size_m.begin(), object.size_m.end()));
      break;
    case Shape::Rectangle:
      positive("size_m", std::min(object.size_m[0], object.size_m[1]));
      break;
    case Shape::Cylinder:
      positive("height_m", object.height.in(metre));
      positive("radius_m", object.radius.in(metre));
      break;
    case Shape::Sphere:
    case Shape::Disc:
      positive("radius_m", object.radius.in(metre));
      break;
    case Shape::Mesh:
      break;
  }
}

/// Keys that the object's shape does not use are mistakes: a sphere with a size, a box with a mesh.
void checkKeysFitShape(Table& table, const ObjectSpec& object) {
  const Shape shape = object.shape;
  const auto only = [&](const char* key, bool is_used) {
    if (table.has(key) && !is_used) table.complain(key, "has no meaning for this shape; remove it");
  };
  only("mesh", shape == Shape::Mesh);
  only("size_m", shape == Shape::Box || shape == Shape::Rectangle);
  only("radius_m", shape == Shape::Sphere || shape == Shape::Cylinder || shape == Shape::Disc);
  only("height_m", shape == Shape::Cylinder);
  if (table.has("euler_deg") && table.has("rotation_wxyz")) {
    table.complain("euler_deg", "and rotation_wxyz both give the orientation; keep one");
  }
  const auto& q = object.rotation_wxyz;
  if (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] < 1e-6) {
    table.complain("rotation_wxyz", "is zero, which is no orientation");
  }
}

void readMaterials(Table& root, SceneSpec& scene) {
  for (Table& table : root.tables("material")) {
    MaterialSpec material;
    table.read(material);
    if (material.name.empty()) table.complain("name", "is missing: every material needs one");
    const bool is_known = std::any_of(scene.materials.begin(), scene.materials.end(),
                                      [&](const auto& m) { return m.name == material.name; });
    if (is_known) {
      table.complain("name", fmt::format("\"{}\" is taken by an earlier material", material.name));
    }
    if (table.has("sigma_deg") && material.model != Reflection::OrenNayar) {
      table.complain("sigma_deg", "needs model = \"oren-nayar\"");
    }
    scene.materials.push_back(std::move(material));
  }
}

PlacedObject readObject(Table& table, const SceneSpec& scene) {
  PlacedObject object;
  object.place = table.place();
  ObjectSpec& spec = object.spec;
  // `mesh = "file"` is enough to say that the shape is a mesh.
  if (table.has("mesh") && !table.has("shape")) spec.shape = Shape::Mesh;
  table.read(spec);
  if (!table.has("mesh") && !table.has("shape")) {
    table.complain("", "this object has neither \"shape\" nor \"mesh\"");
  } else {
    checkSizes(table, spec);
    checkKeysFitShape(table, spec);
  }
  const auto material = std::find_if(scene.materials.begin(), scene.materials.end(),
                                     [&](const auto& m) { return m.name == spec.material; });
  if (material == scene.materials.end()) {
    std::string known;
    for (const auto& m : scene.materials) known += (known.empty() ? "" : ", ") + m.name;
    table.complain("material", fmt::format("\"{}\" is no material of this scene; it has: {}",
                                           spec.material, known.empty() ? "none" : known));
  } else {
    object.material = static_cast<std::size_t>(material - scene.materials.begin());
  }
  if (spec.shape == Shape::Mesh) {
    if (spec.file.empty()) table.complain("mesh", "is missing: name the mesh's file");
    object.mesh = table.resolve(spec.file);
  }
  object.world_from_object = poseOf(spec, table.has("euler_deg"));
  return object;
}

Result<SceneFile> read(Table root) {
  SceneFile file;
  readMaterials(root, file.spec);
  for (Table& table : root.tables("object")) {
    file.objects.push_back(readObject(table, file.spec));
    file.spec.objects.push_back(file.objects.back().spec);
  }
  if (auto ambient = root.table("ambient")) ambient->read(file.spec.ambient);
  if (file.objects.empty()) root.complain("", "the scene has no [[object]]");
  if (auto checked = root.check(); !checked) return checked.error();
  return file;
}

}  // namespace

Result<SceneFile> loadSceneFile(const std::filesystem::path& file) {
  auto table = Table::load(file);
  if (!table) return table.error();
  return read(*std::move(table));
}

Result<SceneFile> parseSceneFile(std::string_view toml, const std::filesystem::path& name) {
  auto table = Table::parse(toml, name);
  if (!table) return table.error();
  return read(*std::move(table));
}

}  // namespace toftwin::sim
