// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/scene_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "protocol/settings/describe.h"
#include "protocol/settings/settings.h"
#include "sim/tracer/scene_tables.h"
#include "sim/tracer/world_scene.h"

namespace toftwin::sim {
namespace {

using settings::Table;

/// The pose that an object or a keyframe gives.
template <class Spec>
Transform<World, Object> poseOf(const Spec& object, bool from_euler) {
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

void checkDirection(Table& table, const char* key, const std::array<double, 3>& direction) {
  if (norm(vec3Of(direction)) < 1e-6) table.complain(key, "is zero, which is no direction");
}

void checkOrientation(Table& table, const std::array<double, 4>& q) {
  if (table.has("euler_deg") && table.has("rotation_wxyz")) {
    table.complain("euler_deg", "and rotation_wxyz both give the orientation; keep one");
  }
  if (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] < 1e-6) {
    table.complain("rotation_wxyz", "is zero, which is no orientation");
  }
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
  for (const char* key : {"mesh", "unit", "up"}) only(key, shape == Shape::Mesh);
  only("size_m", shape == Shape::Box || shape == Shape::Rectangle);
  only("radius_m", shape == Shape::Sphere || shape == Shape::Cylinder || shape == Shape::Disc);
  only("height_m", shape == Shape::Cylinder);
  checkOrientation(table, object.rotation_wxyz);
}

/// Keys that the material's model does not use are mistakes: a mirror's roughness, a wall's index.
void checkKeysFitModel(Table& table, Reflection model) {
  const auto only = [&](const char* key, std::initializer_list<Reflection> users, const char* needed) {
    if (table.has(key) && std::find(users.begin(), users.end(), model) == users.end()) {
      table.complain(key, fmt::format("needs model = {}", needed));
    }
  };
  using enum Reflection;
  only("sigma_deg", {OrenNayar}, "\"oren-nayar\"");
  only("roughness", {RoughDielectric, RoughMetal}, "\"rough-dielectric\" or \"rough-metal\"");
  only("index", {RoughDielectric, ThinGlass}, "\"rough-dielectric\" or \"thin-glass\"");
  for (const char* key : {"lobe_deg", "lobe_share"}) only(key, {Retroreflector}, "\"retroreflector\"");
  for (const char* key : {"through", "delay_ns"}) only(key, {Translucent}, "\"translucent\"");
  for (const char* key : {"clarity", "thickness_mm"}) only(key, {ThinGlass}, "\"thin-glass\"");
  for (const char* key : {"albedo", "texture"}) {
    if (table.has(key) && model == ThinGlass)
      table.complain(key, "has no meaning for thin-glass; see index and clarity");
  }
  if (table.has("texture_coding") && !table.has("texture"))
    table.complain("texture_coding", "needs a texture");
}

void readMaterials(Table& root, SceneFile& file) {
  SceneSpec& scene = file.spec;
  for (Table& table : root.tables("material")) {
    MaterialSpec material = readMaterial(table, file.textures.emplace_back());
    if (material.name.empty()) table.complain("name", "is missing: every material needs one");
    const bool is_known = std::any_of(scene.materials.begin(), scene.materials.end(),
                                      [&](const auto& m) { return m.name == material.name; });
    if (is_known) {
      table.complain("name", fmt::format("\"{}\" is taken by an earlier material", material.name));
    }
    scene.materials.push_back(std::move(material));
  }
}

/// How the object moves, by its steady rates or by its keyframes.
Motion readMotion(Table& table, const ObjectSpec& object) {
  Motion motion{.velocity_m_per_s = vec3Of(object.velocity_m_per_s),
                .rotation_rad_per_s = vec3Of(object.rotation_rate_deg_per_s) * degree.in_si,
                .keys = {},
                .period_s = object.period.in(second)};
  if (!table.has("keyframe")) {
    if (table.has("period_s")) table.complain("period_s", "needs keyframes");
    return motion;
  }
  for (const char* key :
       {"velocity_m_per_s", "rotation_rate_deg_per_s", "position_m", "rotation_wxyz", "euler_deg"}) {
    if (table.has(key))
      table.complain(key, "has no meaning beside keyframes, which say where the object is; remove it");
  }
  std::size_t i = 0;
  for (Table& frame : table.tables("keyframe")) {
    frame.acceptAll();  // they were read with the object
    const KeyframeSpec& spec = object.keyframes[i++];
    checkOrientation(frame, spec.rotation_wxyz);
    const Transform<World, Object> pose = poseOf(spec, frame.has("euler_deg"));
    const double time = spec.time.in(second);
    if (motion.period_s > 0.0 && time > motion.period_s) {
      frame.complain("time_s", fmt::format("= {} is beyond period_s = {}, so it is never reached", time,
                                           motion.period_s));
    }
    if (!motion.keys.empty() && time <= motion.keys.back().time_s) {
      frame.complain("time_s", "is not later than that of the keyframe before");
    }
    motion.keys.push_back({time, pose.rotation_wxyz, pose.translation_m});
  }
  return motion;
}

void readAmbient(Table& root, SceneFile& file) {
  auto table = root.table("ambient");
  if (!table) return;
  AmbientSpec& ambient = file.spec.ambient;
  table->read(ambient);
  if (!ambient.map.empty()) file.map = {table->resolve(ambient.map), table->place("map")};
  checkDirection(*table, "up", ambient.up);
  checkDirection(*table, "ahead", ambient.ahead);
  checkDirection(*table, "sun_towards", ambient.sun_towards);
  const Vec3d across = cross(vec3Of(ambient.up), vec3Of(ambient.ahead));
  if (norm(across) < 1e-3 * norm(vec3Of(ambient.up)) * norm(vec3Of(ambient.ahead))) {
    table->complain("ahead", "points along `up`: the map would have no direction");
  }
  for (const char* key : {"map_radiance_w_per_m2_sr", "up", "ahead"}) {
    if (table->has(key) && ambient.map.empty()) table->complain(key, "needs a map");
  }
}

void readForeignEmitters(Table& root, SceneSpec& scene) {
  for (Table& table : root.tables("foreign_emitter")) {
    ForeignEmitterSpec& emitter = scene.foreign_emitters.emplace_back();
    table.read(emitter);
    checkDirection(table, "axis", emitter.axis);
    if (emitter.power_w == 0.0) table.complain("power_w", "= 0 gives no light; remove this emitter");
    using Wave = ForeignEmitterSpec::Wave;
    const auto needs = [&](const char* key, bool is_met, const char* what) {
      if (table.has(key) && !is_met) table.complain(key, fmt::format("has no meaning without emitted = {}", what));
    };
    needs("emitted_duty", emitter.emitted == Wave::Square, "\"square\"");
    needs("emitted_clip", emitter.emitted == Wave::ClippedSine, "\"clipped_sine\"");
    needs("rise_ns", emitter.emitted != Wave::LikeCamera, "a waveform of its own");
  }
}

/// Formats that say what surfaces are like.
bool hasMaterials(const ObjectSpec& object) {
  return object.shape == Shape::Mesh && (object.file.ends_with(".gltf") || object.file.ends_with(".glb"));
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
  if (spec.material.empty() && hasMaterials(spec)) {
    // Its file's own.
  } else if (material == scene.materials.end()) {
    std::string known;
    for (const auto& m : scene.materials) known += (known.empty() ? "" : ", ") + m.name;
    if (spec.material.empty())
      table.complain("", "this object has no material");
    else
      table.complain("material", fmt::format("\"{}\" is no material of this scene; it has: {}", spec.material,
                                             known.empty() ? "none" : known));
  } else {
    object.material = static_cast<std::size_t>(material - scene.materials.begin());
  }
  if (spec.shape == Shape::Mesh) {
    if (spec.file.empty()) table.complain("mesh", "is missing: name the mesh's file");
    object.mesh = table.resolve(spec.file);
  }
  object.motion = readMotion(table, spec);
  object.world_from_object = poseAt(object.motion, poseOf(spec, table.has("euler_deg")), 0_s);
  return object;
}

/// Two surfaces in one place: rounding would decide which of them light meets.
void checkAlone(Table& table, const SceneFile& file, std::map<std::string, std::size_t>& earlier) {
  const PlacedObject& object = file.objects.back();
  std::string where;
  for (const settings::Key& key : settings::keysOf(object.spec)) {
    if (key.name != "name" && key.name != "material") where += key.name + key.value + "\n";
  }
  for (const KeyframeSpec& frame : object.spec.keyframes) {
    for (const settings::Key& key : settings::keysOf(frame)) where += key.name + key.value + "\n";
  }
  const auto [same, is_new] = earlier.emplace(std::move(where), file.objects.size() - 1);
  if (is_new) return;
  table.complain("", fmt::format("this object is in the same place as that of {}, with the same shape and size; "
                                 "remove one",
                                 file.objects[same->second].place));
}

Result<SceneFile> read(Table root) {
  SceneFile file;
  std::map<std::string, std::size_t> places;
  readMaterials(root, file);
  for (Table& table : root.tables("object")) {
    file.objects.push_back(readObject(table, file.spec));
    checkAlone(table, file, places);
    file.spec.objects.push_back(file.objects.back().spec);
  }
  readLight(root, file);
  if (file.objects.empty()) root.complain("", "the scene has no [[object]]");
  if (auto checked = root.check(); !checked) return checked.error();
  return file;
}

}  // namespace

MaterialSpec readMaterial(Table& table, NamedFile& texture) {
  MaterialSpec material;
  table.read(material);
  checkKeysFitModel(table, material.model);
  if (!material.texture.empty()) texture = {table.resolve(material.texture), table.place("texture")};
  if (!material.color.empty() && material.color.size() != 3)
    table.complain("color", "must be three numbers: red, green, blue");
  return material;
}

void readLight(Table& root, SceneFile& file) {
  readAmbient(root, file);
  readForeignEmitters(root, file.spec);
}

Result<SceneFile> loadSceneFile(const std::filesystem::path& file, const SceneLoading& how) {
  if (isWorld(file)) return loadWorld(file, how);
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
