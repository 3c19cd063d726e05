// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/fields.h>
#include <toftwin/geometry.h>
#include <toftwin/result.h>
#include <toftwin/units.h>

#include "sim/meshes/mesh_file.h"
#include "sim/tracer/motion.h"
#include "sim/tracer/scene_loading.h"

namespace toftwin::sim {

enum class Reflection {
  Lambertian,
  OrenNayar,
  RoughDielectric,
  RoughMetal,
  Mirror,
  Retroreflector,
  Translucent,
  ThinGlass
};
enum class TextureCoding { Linear, Srgb };
/// Which of a mesh file's axes points up; the scene's is −y.
enum class Up { MinusY, Y, Z };
enum class LengthUnit { Metre, Centimetre, Millimetre, Inch, Foot };
enum class Shape { Rectangle, Box, Sphere, Cylinder, Disc, Mesh };

/// What a surface does with light. Both sides of a surface are alike.
struct MaterialSpec {
  std::string name;
  Reflection model = Reflection::Lambertian;
  double albedo = 0.5;
  std::string texture;
  TextureCoding texture_coding = TextureCoding::Linear;
  Angle sigma{};
  double roughness = 0.3;
  double index = 1.5;
  Angle lobe = 1.0 * degree;
  double lobe_share = 1.0;
  double through = 0.0;
  Duration delay{};
  double clarity = 1.0;
  Length thickness{};
  double emission = 0.0;
  std::vector<double> color;  ///< red, green, blue; empty: as the albedo

  bool operator==(const MaterialSpec&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "how objects refer to it; every material has its own");
    v.choice("model", model,
             {{"lambertian", Reflection::Lambertian},
              {"oren-nayar", Reflection::OrenNayar},
              {"rough-dielectric", Reflection::RoughDielectric},
              {"rough-metal", Reflection::RoughMetal},
              {"mirror", Reflection::Mirror},
              {"retroreflector", Reflection::Retroreflector},
              {"translucent", Reflection::Translucent},
              {"thin-glass", Reflection::ThinGlass}},
             "how reflected light is spread; oren-nayar is the qualitative model of 1994");
    v.number("albedo", albedo, {0.0, 1.0},
             "share of the arriving light that is reflected, at the camera's wavelength; rough-metal: ahead; "
             "rough-dielectric: of the light that enters its body; not for thin-glass");
    v.text("texture", texture,
           "picture whose grey values, 0 to 1, multiply the albedo: PNG, JPEG, TIFF or HDR, relative to the "
           "scene file");
    v.choice("texture_coding", texture_coding,
             {{"linear", TextureCoding::Linear}, {"srgb", TextureCoding::Srgb}},
             "whether its values are reflectances or made for screens");
    v.quantity("sigma", sigma, degree, {0.0, 90.0},
               "oren-nayar: standard deviation of the facets' slope angle");
    v.number("roughness", roughness, {0.02, 1.0},
             "rough-dielectric, rough-metal: GGX with alpha = roughness squared; smoother ones are mirrors");
    v.number("index", index, {1.0, 4.0}, "rough-dielectric, thin-glass: refractive index");
    v.quantity("lobe", lobe, degree, {0.02, 30.0},
               "retroreflector: standard deviation of its lobe about the way back, on each of two axes");
    v.number("lobe_share", lobe_share, {0.0, 1.0},
             "retroreflector: share of reflected light in the lobe; the rest is Lambertian");
    v.number("through", through, {0.0, 1.0},
             "translucent: share of the scattered light that leaves on the other side");
    v.quantity("delay", delay, nanosecond, {0.0, 100.0},
               "translucent: mean time within the material; its distribution is exponential");
    v.number("clarity", clarity, {0.0, 1.0},
             "thin-glass: what one crossing along the normal lets through, surfaces aside");
    v.quantity("thickness", thickness, millimetre, {0.0, 100.0},
               "thin-glass: delays the light that goes through");
    v.number("emission_w_per_m2_sr", emission, {0.0, 1e9},
             "own radiance, not modulated: a lamp, a window; it counts as ambient light");
    v.numbers("color", color, {0.0, 1.0},
              "share of the visible light that is reflected: red, green, blue, for colour cameras; left out: as the albedo");
  }
};

/// Where a moving thing is at one time.
struct KeyframeSpec {
  Duration time{};
  std::array<double, 3> position_m{};
  std::array<double, 4> rotation_wxyz{1.0, 0.0, 0.0, 0.0};
  std::array<double, 3> euler_deg{};

  bool operator==(const KeyframeSpec&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.quantity("time", time, second, {-1e6, 1e6}, "from device time 0; each later than the one before");
    v.numbers("position_m", position_m, {-1e6, 1e6}, "as of the object, instead of its own");
    v.numbers("rotation_wxyz", rotation_wxyz, {-1.0, 1.0}, "as of the object, instead of its own");
    v.numbers("euler_deg", euler_deg, {-360.0, 360.0}, "instead of the quaternion");
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
  LengthUnit unit = LengthUnit::Metre;
  Up up = Up::MinusY;
  std::string material;
  std::array<double, 3> velocity_m_per_s{};
  std::array<double, 3> rotation_rate_deg_per_s{};
  std::vector<KeyframeSpec> keyframes;
  Duration period{};

  bool operator==(const ObjectSpec&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "what people call it; it changes nothing");
    v.choice("shape", shape,
             {{"rectangle", Shape::Rectangle},
              {"box", Shape::Box},
              {"sphere", Shape::Sphere},
              {"cylinder", Shape::Cylinder},
              {"disc", Shape::Disc},
              {"mesh", Shape::Mesh}},
             "what it is; to be said, unless `mesh` names a file");
    v.text("mesh", file, "mesh: OBJ, PLY, STL, glTF or GLB file, relative to the scene file");
    v.numbers(
        "size_m", size_m, {0.0, 1e5},
        "box: edges along x, y, z; rectangle: edges along x and y (its normal is z), the third is not used");
    v.quantity("radius", radius, metre, {0.0, 1e5}, "sphere, cylinder, disc");
    v.quantity("height", height, metre, {0.0, 1e5}, "cylinder, along its z axis; both ends are closed");
    v.numbers("position_m", position_m, {-1e6, 1e6},
              "of its centre (mesh: of the file's origin) in the world");
    v.numbers("rotation_wxyz", rotation_wxyz, {-1.0, 1.0},
              "orientation as a quaternion w, x, y, z; it is normalised");
    v.numbers("euler_deg", euler_deg, {-360.0, 360.0},
              "orientation instead of the quaternion: turn about the fixed world axes x, then y, then z");
    v.number("scale", scale, {1e-6, 1e6}, "factor on all its lengths");
    v.choice("unit", unit,
             {{"m", LengthUnit::Metre},
              {"cm", LengthUnit::Centimetre},
              {"mm", LengthUnit::Millimetre},
              {"in", LengthUnit::Inch},
              {"ft", LengthUnit::Foot}},
             "mesh: in which its file's coordinates are");
    v.choice("up", up, {{"-y", Up::MinusY}, {"y", Up::Y}, {"z", Up::Z}},
             "mesh: its file's axis that is turned to the scene's up, -y; x stays x");
    v.text("material", material,
           "name of a material; may be left out for glTF and GLB files, which have materials of their own");
    v.numbers("velocity_m_per_s", velocity_m_per_s, {-1e4, 1e4},
              "how fast it moves in the world; its position is that at time 0");
    v.numbers("rotation_rate_deg_per_s", rotation_rate_deg_per_s, {-36000.0, 36000.0},
              "how fast it turns about its centre: a vector along the axis, in the world");
    v.group("keyframe", keyframes, "where it is at certain times");
    v.quantity("period", period, second, {0.0, 1e6}, "keyframes begin anew after it; 0: never");
  }
};

struct AmbientSpec {
  double radiance = 0.0;
  std::string map;
  double map_radiance = 1.0;
  std::array<double, 3> up{0.0, -1.0, 0.0};
  std::array<double, 3> ahead{0.0, 0.0, 1.0};
  Illuminance sun{};
  std::array<double, 3> sun_towards{0.0, -1.0, 0.0};
  double sun_irradiance_per_klx = 0.27;
  bool operator==(const AmbientSpec&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("radiance_w_per_m2_sr", radiance, {0.0, 1e9},
             "light from every direction in which there is nothing, not modulated, in the camera's band");
    v.text("map", map,
           "picture of the surroundings in latitude and longitude, besides: PNG, JPEG, TIFF or HDR, relative "
           "to the scene "
           "file; its top row is up, its middle column ahead");
    v.number("map_radiance_w_per_m2_sr", map_radiance, {0.0, 1e9},
             "of a value of 1 in the map (the largest of an integer file)");
    v.numbers("up", up, {-1.0, 1.0}, "where the map's top is, in the world; any length but 0");
    v.numbers("ahead", ahead, {-1.0, 1.0}, "where the map's middle column is, in the world; not along `up`");
    v.quantity("sun", sun, kilolux, {0.0, 200.0},
               "illuminance by a sun in the sky, on what faces it; 100 on a clear noon");
    v.numbers("sun_towards", sun_towards, {-1.0, 1.0},
              "where the sun stands, in the world; any length but 0");
    v.number("sun_w_per_m2_per_klx", sun_irradiance_per_klx, {0.0, 100.0},
             "in the camera's band, per kilolux: 0.27 for the sun through a 30 nm filter at 850 nm (ASTM "
             "G173-03)");
  }
};

/// The light of another camera, or of any modulated lamp, that stands still in the scene.
struct ForeignEmitterSpec {
  enum class Wave { LikeCamera, Sine, Square, ClippedSine };

  std::string name;
  std::array<double, 3> position_m{};
  std::array<double, 3> axis{0.0, 0.0, 1.0};
  Length radius{};
  double power_w = 1.0;
  double lobe_exponent = 1.0;
  Angle half_angle = 90.0 * degree;
  bool isotropic = false;
  Frequency frequency = 20_MHz;
  Wave emitted = Wave::LikeCamera;
  double duty = 0.5, clip = 0.75;
  Duration rise = 0_ns;
  double modulation = 1.0;
  Angle phase{};
  bool operator==(const ForeignEmitterSpec&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "what people call it; it changes nothing");
    v.numbers("position_m", position_m, {-1e6, 1e6}, "in the world");
    v.numbers("axis", axis, {-1.0, 1.0}, "where it points, in the world; any length but 0");
    v.quantity("radius", radius, millimetre, {0.0, 1000.0}, "of the shining disc; 0: a point");
    v.number("power_w", power_w, {0.0, 1e6}, "mean optical power of the uncut lobe over the half space");
    v.number("lobe_exponent", lobe_exponent, {0.0, 1000.0},
             "m of I = power (m + 1) / 2 pi cos^m: 1 is Lambertian");
    v.quantity("half_angle", half_angle, degree, {0.1, 90.0}, "no light outside this cone");
    v.flag("isotropic", isotropic, "the same in all directions instead, power / 4 pi");
    v.quantity("frequency", frequency, megahertz, {0.001, 1000.0}, "of its modulation");
    v.choice("emitted", emitted,
             {std::pair{"like_camera", Wave::LikeCamera}, std::pair{"sine", Wave::Sine}, std::pair{"square", Wave::Square},
              std::pair{"clipped_sine", Wave::ClippedSine}},
             "its waveform; like_camera: that of the camera which sees it, for a camera of the same kind");
    v.number("emitted_duty", duty, {0.001, 0.99}, "square: share of the period that is on");
    v.number("emitted_clip", clip, {0.05, 1.0}, "clipped_sine: cut at this share of the amplitude");
    v.quantity("rise", rise, nanosecond, {0.0, 1000.0}, "time constant of its low pass, not with like_camera");
    v.number("modulation", modulation, {0.0, 1.0},
             "how much of the waveform's modulation it has: 1 all of it, 0 light that is not modulated");
    v.quantity("phase", phase, degree, {-360.0, 360.0}, "of its modulation at device time 0");
  }
};

/// A scene file as it was written, checked. Object and material references are resolved.
struct SceneSpec {
  std::vector<MaterialSpec> materials;
  std::vector<ObjectSpec> objects;
  AmbientSpec ambient;
  std::vector<ForeignEmitterSpec> foreign_emitters;

  template <class Visitor>
  void visit(Visitor& v) {
    v.group("material", materials, "surfaces");
    v.group("object", objects, "things");
    v.group("ambient", ambient, "light that is not the camera's");
    v.group("foreign_emitter", foreign_emitters, "light of other cameras");
  }
};

/// An object ready to be built: its material's index, its pose, its mesh's absolute path, and where in
/// the file it was written.
struct PlacedObject {
  ObjectSpec spec;
  std::optional<std::size_t> material;  ///< none: those of its mesh file
  Transform<World, Object> world_from_object;  ///< without the scale
  Motion motion;
  std::filesystem::path mesh;
  std::string place;       ///< "scene.toml:12"
  std::size_t number = 0;  ///< of the object in the file; the same for all that a mesh file's surfaces make of it
  Vec3d stretch{1, 1, 1};  ///< of a mesh: factors along its file's axes
  std::shared_ptr<const TriangleMesh> triangles = nullptr;  ///< of a mesh once it is read; shared by copies
};

/// A file that the scene names, and where it does.
struct NamedFile {
  std::filesystem::path path;         ///< empty: none
  std::string place;                  ///< "scene.toml:12"
  std::vector<std::byte> bytes = {};  ///< instead of a file: what it would hold
  [[nodiscard]] bool isThere() const { return !path.empty() || !bytes.empty(); }
};

struct SceneFile {
  SceneSpec spec;
  std::vector<PlacedObject> objects;
  std::vector<NamedFile> textures;  ///< of the materials
  NamedFile map;                    ///< of the surroundings
  std::vector<std::string> notes;   ///< what was left out, for people
};

/// A scene file, or a world of another kind (world_scene.h).
Result<SceneFile> loadSceneFile(const std::filesystem::path& file, const SceneLoading& how = {});
Result<SceneFile> parseSceneFile(std::string_view toml, const std::filesystem::path& name);

}  // namespace toftwin::sim
