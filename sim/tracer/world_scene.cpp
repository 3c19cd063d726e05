// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/world_scene.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <optional>

#include "sim/tracer/scene_meshes.h"
#include "sim/tracer/scene_tables.h"
#include "sim/worlds/world.h"

namespace toftwin::sim {
namespace {

using settings::Table;

std::string extensionOf(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

bool isGltf(const std::filesystem::path& file) { return extensionOf(file) == ".gltf" || extensionOf(file) == ".glb"; }

/// A material of the file beside a world, and for what it is.
struct Matched {
  std::vector<std::string> patterns;
  std::size_t material = 0;

  [[nodiscard]] bool fits(const std::string& name) const {
    return !name.empty() && std::ranges::any_of(patterns, [&](const std::string& pattern) {
      return ::fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
    });
  }
};

/// A world's scene while it is put together.
class WorldScene {
 public:
  explicit WorldScene(const std::filesystem::path& file) : file_(file) {
    const bool is_gltf = isGltf(file);
    scene_.spec.ambient.up = is_gltf ? std::array{0.0, 1.0, 0.0} : std::array{0.0, 0.0, 1.0};
    scene_.spec.ambient.ahead = is_gltf ? std::array{0.0, 0.0, -1.0} : std::array{1.0, 0.0, 0.0};
  }

  /// FILE.toml, if it is there.
  Result<worlds::WorldOptions> readBeside() {
    worlds::WorldOptions options;
    const std::filesystem::path beside = file_.string() + ".toml";
    std::error_code fault;
    if (!std::filesystem::exists(beside, fault)) return options;
    auto root = Table::load(beside);
    if (!root) return root.error();
    WorldSpec spec;
    root->read(spec);
    for (const auto* folders : {&spec.model_path, &spec.package_path}) {
      for (const std::string& folder : *folders) options.search.push_back(std::filesystem::absolute(root->resolve(folder)));
    }
    for (const JointSpec& joint : spec.joints) options.joints[joint.name] = joint.position;
    for (Table& table : root->tables("material")) readMatched(table);
    readLight(*root, scene_);
    if (auto checked = root->check(); !checked) return checked.error();
    return options;
  }

  void add(const worlds::Thing& thing) {
    ObjectSpec spec;
    spec.name = thing.name;
    spec.shape = shapeOf(thing.shape);
    spec.size_m = {thing.size_m.x, thing.size_m.y, thing.size_m.z};
    spec.radius = thing.radius_m * metre;
    spec.height = thing.height_m * metre;
    spec.file = thing.mesh.filename().string();
    if (!(std::min({thing.size_m.x, thing.size_m.y, thing.radius_m, thing.height_m}) > 0.0)) {
      scene_.notes.push_back(fmt::format("{}: {} has no size, and is left out", file_.filename().string(), thing.name));
      return;
    }
    PlacedObject& object = addObject(std::move(spec), thing.world_from_thing);
    object.mesh = thing.mesh;
    object.stretch = thing.mesh_scale;
    object.material = materialFor(thing.name, thing.has_surface ? &thing.surface : nullptr,
                                  thing.shape == worlds::Shape::Mesh && isGltf(thing.mesh));
  }

  /// Parts of a glTF file, already triangles in the world.
  void add(const meshes::MeshFile& read) {
    for (const meshes::Part& part : read.parts) {
      ObjectSpec spec;
      spec.name = part.name;
      spec.shape = Shape::Mesh;
      PlacedObject& object = addObject(std::move(spec), {});
      object.mesh = file_;
      object.triangles = std::make_shared<const TriangleMesh>(partOf(read.mesh, part.first, part.count));
      object.material = materialFor(part.name, part.surface ? &read.surfaces[*part.surface] : nullptr, false);
    }
    for (const std::string& note : read.notes) addNote(note);
  }

  void addNote(const std::string& note) { scene_.notes.push_back(fmt::format("{}: {}", file_.filename().string(), note)); }

  SceneFile take() { return std::move(scene_); }

 private:
  void readMatched(Table& table) {
    Matched matched;
    if (auto several = table.has("match") ? table.texts("match") : std::nullopt) matched.patterns = *std::move(several);
    if (matched.patterns.empty()) table.complain("match", "is missing: names of objects or surfaces, such as [\"pallet*\"]");
    NamedFile texture;
    MaterialSpec material = readMaterial(table, texture);
    if (material.name.empty() && !matched.patterns.empty()) material.name = matched.patterns.front();
    matched.material = addMaterial(std::move(material), std::move(texture));
    matched_.push_back(std::move(matched));
  }

  std::size_t addMaterial(MaterialSpec material, NamedFile texture) {
    scene_.spec.materials.push_back(std::move(material));
    scene_.textures.push_back(std::move(texture));
    return scene_.spec.materials.size() - 1;
  }

  PlacedObject& addObject(ObjectSpec spec, const Transform<World, Object>& pose) {
    const Vec3d& p = pose.translation_m;
    spec.position_m = {p.x, p.y, p.z};
    spec.rotation_wxyz = pose.rotation_wxyz;
    PlacedObject& object = scene_.objects.emplace_back();
    object.place = fmt::format("{}: {}", file_.filename().string(), spec.name);
    object.world_from_object = pose;
    scene_.spec.objects.push_back(spec);
    object.spec = std::move(spec);
    return object;
  }

  /// Nothing where the mesh's own file says it.
  std::optional<std::size_t> materialFor(const std::string& name, const meshes::Surface* surface, bool mesh_may_say) {
    for (const Matched& matched : matched_) {
      if (matched.fits(name) || (surface != nullptr && matched.fits(surface->name))) return matched.material;
    }
    if (surface == nullptr && mesh_may_say) return std::nullopt;
    if (surface == nullptr) {
      if (!plain_) {
        MaterialSpec plain;
        plain.name = "(nothing is said)";
        plain_ = addMaterial(std::move(plain), {});
      }
      return plain_;
    }
    MaterialSpec material = materialOf(*surface);
    if (!surface->picture.isThere()) {  // surfaces that are alike are one
      for (std::size_t i = 0; i < scene_.spec.materials.size(); ++i) {
        if (scene_.spec.materials[i] == material && !scene_.textures[i].isThere()) return i;
      }
    }
    return addMaterial(std::move(material), {surface->picture.file, file_.filename().string(), surface->picture.bytes});
  }

  static Shape shapeOf(worlds::Shape shape) {
    switch (shape) {
      case worlds::Shape::Plane:
        return Shape::Rectangle;
      case worlds::Shape::Box:
        return Shape::Box;
      case worlds::Shape::Sphere:
        return Shape::Sphere;
      case worlds::Shape::Cylinder:
        return Shape::Cylinder;
      case worlds::Shape::Mesh:
        break;
    }
    return Shape::Mesh;
  }

  const std::filesystem::path& file_;
  SceneFile scene_;
  std::vector<Matched> matched_;
  std::optional<std::size_t> plain_;
};

}  // namespace

bool isWorld(const std::filesystem::path& file) {
  const std::string extension = extensionOf(file);
  return extension == ".sdf" || extension == ".world" || extension == ".urdf" || isGltf(file);
}

Result<SceneFile> loadWorld(const std::filesystem::path& file, const SceneLoading& how) {
  WorldScene scene{file};
  const auto options = scene.readBeside();
  if (!options) return options.error();
  if (isGltf(file)) {
    const auto read = meshes::readMeshFile(file, {how.stop, how.may_convert});
    if (!read) return read.error();
    scene.add(*read);
    return scene.take();
  }
  const auto world = extensionOf(file) == ".urdf" ? worlds::readUrdf(file, *options) : worlds::readSdf(file, *options);
  if (!world) return world.error();
  for (const worlds::Thing& thing : world->things) scene.add(thing);
  for (const std::string& note : world->notes) scene.addNote(note);
  return scene.take();
}

}  // namespace toftwin::sim
