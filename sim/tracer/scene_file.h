// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/fields.h>
#include <toftwin/geometry.h>
#include <toftwin/result.h>
#include <toftwin/units.h>

namespace toftwin::sim {

enum class Reflection { Lambertian, OrenNayar };
enum class Shape { Rectangle, Box, Sphere, Cylinder, Disc, Mesh };

/// What a surface does with light. Both sides of a surface are alike.
struct MaterialSpec {
  std::string name;
  Reflection model = Reflection::Lambertian;
  double albedo = 0.5;
  Angle sigma{};
  double emission = 0.0;

  bool operator==(const MaterialSpec&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "how objects refer to it; every material has its own");
    v.choice("model", model,
             {{"lambertian", Reflection::Lambertian}, {"oren-nayar", Reflection::OrenNayar}},
             "how reflected light is spread; oren-nayar is the qualitative model of 1994");
    v.number("albedo", albedo, {0.0, 1.0}, "share of the arriving light that is reflected, at the camera's wavelength");
    v.quantity("sigma", sigma, degree, {0.0, 90.0}, "oren-nayar: standard deviation of the facets' slope angle");
    v.number("emission_w_per_m2_sr", emission, {0.0, 1e9},
             "own radiance, not modulated: a lamp, a window; it counts as ambient light");
  }
};

/// A thing in the scene. Its own frame has its centre at the origin.
struct ObjectSpec {
  std::string name;
  Shape shape = Shape::Rectangle;
  std::string file;
  std::array<double, 3> size_m{1.0, 1.0, 1.0};
  Length radius = 0.5_m;
  Length height = 1_m;
  std::array<double, 3> position_m{};
  std::array<double, 4> rotation_wxyz{1.0, 0.0, 0.0, 0.0};
  std::array<double, 3> euler_deg{};
  double scale = 1.0;
  std::string material;

  bool operator==(const ObjectSpec&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "what people call it; it changes nothing");
    v.choice("shape", shape,
             {{"rectangle", Shape::Rectangle}, {"box", Shape::Box}, {"sphere", Shape::Sphere},
              {"cylinder", Shape::Cylinder}, {"disc", Shape::Disc}, {"mesh", Shape::Mesh}},
             "what it is; to be said, unless `mesh` names a file");
    v.text("mesh", file, "mesh: OBJ, PLY, glTF or GLB file in metres, relative to the scene file");
    v.numbers("size_m", size_m, {0.0, 1e5},
              "box: edges along x, y, z; rectangle: edges along x and y (its normal is z), the third is not used");
    v.quantity("radius", radius, metre, {0.0, 1e5}, "sphere, cylinder, disc");
    v.quantity("height", height, metre, {0.0, 1e5}, "cylinder, along its z axis; both ends are closed");
    v.numbers("position_m", position_m, {-1e6, 1e6}, "of its centre (mesh: of the file's origin) in the world");
    v.numbers("rotation_wxyz", rotation_wxyz, {-1.0, 1.0},
              "orientation as a quaternion w, x, y, z; it is normalised");
    v.numbers("euler_deg", euler_deg, {-360.0, 360.0},
              "orientation instead of the quaternion: turn about the fixed world axes x, then y, then z");
    v.number("scale", scale, {1e-6, 1e6}, "factor on all its lengths");
    v.text("material", material, "name of a material");
  }
};

struct AmbientSpec {
  double radiance = 0.0;
  bool operator==(const AmbientSpec&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("radiance_w_per_m2_sr", radiance, {0.0, 1e9},
             "light from every direction in which there is nothing, not modulated, in the camera's band");
  }
};

/// A scene file as it was written, checked. Object and material references are resolved.
struct SceneSpec {
  std::vector<MaterialSpec> materials;
  std::vector<ObjectSpec> objects;
  AmbientSpec ambient;

  template <class Visitor>
  void visit(Visitor& v) {
    v.group("material", materials, "surfaces");
    v.group("object", objects, "things");
    v.group("ambient", ambient, "light that is not the camera's");
  }
};

/// An object ready to be built: its material's index, its pose, its mesh's absolute path, and where in
/// the file it was written.
struct PlacedObject {
  ObjectSpec spec;
  std::size_t material = 0;
  Transform<World, Object> world_from_object;  ///< without the scale
  std::filesystem::path mesh;
  std::string place;  ///< "scene.toml:12"
};

struct SceneFile {
  SceneSpec spec;
  std::vector<PlacedObject> objects;
};

Result<SceneFile> loadSceneFile(const std::filesystem::path& file);
Result<SceneFile> parseSceneFile(std::string_view toml, const std::filesystem::path& name);

}  // namespace toftwin::sim
