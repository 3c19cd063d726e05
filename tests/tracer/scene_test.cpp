// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "protocol/settings/describe.h"
#include "sim/tracer/lens.h"
#include "sim/tracer/scene_file.h"
#include "tests/tracer/tracing.h"

namespace toftwin::sim::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr auto kMaterial = "[[material]]\nname = 'm'\n";

std::string errorOf(const std::string& toml) {
  const auto scene = Scene::parse(toml, "scene.toml");
  return scene ? "no error" : scene.error().message;
}

class SceneFiles : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream{folder_ / name, std::ios::binary} << text;
    return folder_ / name;
  }
  [[nodiscard]] Result<Scene> load(const std::string& toml) const { return Scene::load(write("scene.toml", toml)); }
  [[nodiscard]] Result<Scene> loadMesh(const std::string& name) const {
    return load(kMaterial + ("[[object]]\nmesh = '" + name) + "'\nposition_m = [0, 0, 2]\nmaterial = 'm'\n");
  }
  [[nodiscard]] std::string errorOfMesh(const std::string& name) const {
    const auto scene = loadMesh(name);
    return scene ? "no error" : scene.error().message;
  }

  std::filesystem::path folder_ = std::filesystem::temp_directory_path() / ("toftwin_scene_test_" + std::to_string(::getpid()));
};

float rangeAhead(const Scene& scene) { return trace(scene, requestFor(1, 1, 1.0, {})).truth.range_m(0, 0); }

TEST(SceneFile, NamesFileLineAndKeyOfEveryMistake) {
  const std::string error = errorOf(
      "[[material]]\nname = 'm'\nalbdo = 0.5\n[[object]]\nshape = 'sphere'\nradius_m = -1\nmaterial = 'x'\n");
  EXPECT_THAT(error, AllOf(HasSubstr("scene.toml:3: unknown key \"albdo\""),
                           HasSubstr("scene.toml:6: radius_m = -1 m is out of bounds"),
                           HasSubstr("scene.toml:7: material \"x\" is no material of this scene; it has: m")));
}

TEST(SceneFile, RefusesWhatHasNoMeaning) {
  const std::string object = std::string{kMaterial} + "[[object]]\nmaterial = 'm'\n";
  EXPECT_THAT(errorOf(kMaterial), HasSubstr("the scene has no [[object]]"));
  EXPECT_THAT(errorOf(object), HasSubstr("neither \"shape\" nor \"mesh\""));
  EXPECT_THAT(errorOf(object + "shape = 'cube'\n"), HasSubstr("must be one of: rectangle, box, sphere, cylinder, disc, mesh"));
  EXPECT_THAT(errorOf(object + "shape = 'sphere'\nsize_m = [1, 1, 1]\n"), HasSubstr("scene.toml:6: size_m has no meaning for this shape"));
  EXPECT_THAT(errorOf(object + "shape = 'box'\nsize_m = [1, 0, 1]\n"), HasSubstr("size_m must be greater than 0"));
  EXPECT_THAT(errorOf(object + "shape = 'box'\nrotation_wxyz = [0, 0, 0, 0]\n"), HasSubstr("is zero, which is no orientation"));
  EXPECT_THAT(errorOf(object + "shape = 'box'\nrotation_wxyz = [1, 0, 0, 0]\neuler_deg = [1, 0, 0]\n"), HasSubstr("keep one"));
  EXPECT_THAT(errorOf(object + "shape = 'box'\nposition_m = [0, nan, 0]\n"), HasSubstr("position_m[1]"));
  EXPECT_THAT(errorOf(object + "shape = 'mesh'\n"), HasSubstr("mesh is missing"));
  EXPECT_THAT(errorOf(std::string{kMaterial} + kMaterial), HasSubstr("is taken by an earlier material"));
  EXPECT_THAT(errorOf("[[material]]\nname = 'm'\nsigma_deg = 20\n"), HasSubstr("needs model = \"oren-nayar\""));
  EXPECT_THAT(errorOf("[[material]]\nalbedo = 1.5\n"), AllOf(HasSubstr("albedo = 1.5 is out of bounds"), HasSubstr("every material needs one")));
}

TEST(SceneFile, RefusesWhatCannotBeSeen) {
  const std::string box = std::string{kMaterial} + "[[object]]\nmaterial = 'm'\nshape = 'box'\n";
  EXPECT_THAT(errorOf(box + "[[object]]\nname = 'twin'\nmaterial = 'm'\nshape = 'box'\n"),
              HasSubstr("this object is in the same place as that of scene.toml:3"));
  EXPECT_EQ(errorOf(box + "[[object]]\nmaterial = 'm'\nshape = 'box'\nposition_m = [1, 0, 0]\n"), "no error");
  EXPECT_THAT(errorOf(box + "[[foreign_emitter]]\nemitted = 'sine'\nemitted_duty = 0.2\n"),
              HasSubstr("scene.toml:8: emitted_duty has no meaning without emitted = \"square\""));
  EXPECT_THAT(errorOf(box + "[[foreign_emitter]]\npower_w = 0\n"), HasSubstr("scene.toml:7: power_w = 0 gives no light"));
  EXPECT_THAT(errorOf(box + "period_s = 1\n[[object.keyframe]]\n[[object.keyframe]]\ntime_s = 2\n"),
              HasSubstr("time_s = 2 is beyond period_s = 1"));
  EXPECT_THAT(errorOf(std::string{kMaterial} + "[[object]]\nshape = 'box'\n"), HasSubstr("this object has no material"));
}

TEST_F(SceneFiles, AMissingOrEmptyOrBrokenMeshIsNamed) {
  EXPECT_THAT(errorOfMesh("none.obj"), AllOf(HasSubstr("scene.toml:3"), HasSubstr("none.obj: no such file")));
  std::filesystem::create_directory(folder_ / "dir.ply");
  EXPECT_THAT(errorOfMesh("dir.ply"), HasSubstr("it is a folder"));
  write("mesh.xyzw", "x");
  EXPECT_THAT(errorOfMesh("mesh.xyzw"), HasSubstr("OBJ, PLY, STL, glTF and GLB can"));
  const std::string two = kMaterial + std::string{"[[object]]\nmesh = 'a.obj'\nmaterial = 'm'\n"
                                                  "[[object]]\nmesh = 'b.obj'\nmaterial = 'm'\n"};
  const auto both = load(two);
  ASSERT_FALSE(both);
  EXPECT_THAT(both.error().message, AllOf(HasSubstr("a.obj: no such"), HasSubstr("b.obj: no such")));
  write("empty.obj", "# nothing\n");
  EXPECT_THAT(errorOfMesh("empty.obj"), HasSubstr("empty.obj"));
  write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  EXPECT_THAT(errorOfMesh("points.obj"), HasSubstr("points.obj"));
  write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
  EXPECT_THAT(errorOfMesh("flat.obj"), AllOf(HasSubstr("scene.toml:3"), HasSubstr("none of its 1 triangles has an area")));
  write("noise.ply", std::string(1000, '\xa7'));
  EXPECT_THAT(errorOfMesh("noise.ply"), HasSubstr("noise.ply"));
  write("cut.glb", std::string("glTF\2\0\0\0\xff\xff\0\0", 12));
  EXPECT_THAT(errorOfMesh("cut.glb"), HasSubstr("cut.glb"));
}

/// A binary PLY, so that not-a-number arrives as it is.
std::string binaryPly(const std::vector<float>& coordinates, const std::vector<int>& faces) {
  std::string text = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(coordinates.size() / 3) +
                     "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                     std::to_string(faces.size() / 3) + "\nproperty list uchar int vertex_indices\nend_header\n";
  text.append(reinterpret_cast<const char*>(coordinates.data()), coordinates.size() * sizeof(float));
  for (std::size_t f = 0; f < faces.size(); f += 3) {
    text += '\3';
    text.append(reinterpret_cast<const char*>(&faces[f]), 3 * sizeof(int));
  }
  return text;
}

TEST_F(SceneFiles, AVertexThatIsNoPlaceIsNamedWithItsMesh) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  write("nan.ply", binaryPly({0, 0, 0, 1, 0, 0, 0, nan, 0}, {0, 1, 2}));
  EXPECT_THAT(errorOfMesh("nan.ply"), AllOf(HasSubstr("nan.ply"), HasSubstr("vertex 2"), HasSubstr("not finite")));
  write("inf.ply", binaryPly({0, 0, 0, inf, 0, 0, 0, 1, 0}, {0, 1, 2}));
  EXPECT_THAT(errorOfMesh("inf.ply"), AllOf(HasSubstr("inf.ply"), HasSubstr("vertex 1")));
  write("far.ply", binaryPly({0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 7}));
  EXPECT_THAT(errorOfMesh("far.ply"), HasSubstr("far.ply"));
}

TEST_F(SceneFiles, MeshesOfAllFormatsStandWhereTheyAreSaidTo) {
  write("square.obj", "v -1 -1 0.5\nv 1 -1 0.5\nv 1 1 0.5\nv -1 1 0.5\nf 1 2 3 4\n");
  write("square.ply", binaryPly({-1, -1, 0.5f, 1, -1, 0.5f, 1, 1, 0.5f, -1, 1, 0.5f}, {0, 1, 2, 0, 2, 3}));
  // Three vertices (-1,-1,0) (3,-1,0) (-1,3,0) and a node that moves them by 0.5 along z.
  write("triangle.gltf",
        R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"translation":[0,0,0.5]}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[-1,-1,0],"max":[3,3,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AACAvwAAgL8AAAAAAABAQAAAgL8AAAAAAACAvwAAQEAAAAAA"}]})");
  for (const char* name : {"square.obj", "square.ply", "triangle.gltf"}) {
    const auto scene = loadMesh(name);
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_FLOAT_EQ(rangeAhead(*scene), 2.5f) << name;
  }
}

TEST_F(SceneFiles, AMeshsUnitAndUpAreTurnedToTheScenes) {
  write("mm.obj", "v -1000 -1000 -500\nv 1000 -1000 -500\nv 1000 1000 -500\nv -1000 1000 -500\nf 1 2 3 4\n");
  const auto rangeBy = [&](const std::string& keys) {
    const auto scene = load(kMaterial + ("[[object]]\nmesh = 'mm.obj'\nposition_m = [0, 0, 2]\nmaterial = 'm'\n" + keys));
    EXPECT_TRUE(scene) << scene.error().message;
    return scene ? rangeAhead(*scene) : 0.0f;
  };
  EXPECT_FLOAT_EQ(rangeBy("unit = 'mm'\n"), 1.5f);
  EXPECT_FLOAT_EQ(rangeBy("unit = 'mm'\nup = 'y'\n"), 2.5f) << "turned about x by half a turn";
  EXPECT_THAT(errorOf(kMaterial + std::string{"[[object]]\nshape = 'box'\nmaterial = 'm'\nup = 'z'\n"}),
              HasSubstr("up has no meaning for this shape"));
}

TEST_F(SceneFiles, AMeshOfASizeThatCannotBeMeantIsNoted) {
  write("mm.obj", "v -150 -150 1350\nv 150 -150 1350\nv 150 150 1350\nf 1 2 3\n");
  const auto scene = loadMesh("mm.obj");
  ASSERT_TRUE(scene);
  EXPECT_THAT(scene->notes(), ::testing::ElementsAre(AllOf(HasSubstr("300 m wide"), HasSubstr("millimetres"))));
  const auto in_mm = load(kMaterial + std::string{"[[object]]\nmesh = 'mm.obj'\nmaterial = 'm'\nunit = 'mm'\n"});
  ASSERT_TRUE(in_mm);
  EXPECT_THAT(in_mm->notes(), ::testing::IsEmpty());
}

TEST_F(SceneFiles, ACubeAtASurveyorsCoordinatesStandsWhereItIsSaidTo) {
  std::string site;
  for (const char* z : {"312.500", "312.800"}) {
    for (const char* corner : {"432123.456 812345.678 ", "432123.756 812345.678 ", "432123.756 812345.978 ", "432123.456 812345.978 "})
      site += "v " + std::string{corner} + z + "\n";
  }
  write("site.obj", site + "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  const auto scene = load(kMaterial + std::string{"[[object]]\nmesh = 'site.obj'\nmaterial = 'm'\n"
                                                  "position_m = [-432123.606, -812345.828, -311.0]\n"});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_NEAR(rangeAhead(*scene), 1.5, 1e-6);
}

TEST_F(SceneFiles, AGltfFilesSurfacesAreMaterials) {
  // One triangle as in the test above, of two surfaces: the second primitive is the first 1 m further.
  write("two.gltf",
        R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],"nodes":[{"mesh":0,"translation":[0,0,0.5]},{"mesh":1,"translation":[0,0,1.5]}],
"materials":[{"name":"paper","pbrMetallicRoughness":{"baseColorFactor":[0.9,0.9,0.9,1],"metallicFactor":0}},{"name":"steel","pbrMetallicRoughness":{"roughnessFactor":0.4}}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]},{"primitives":[{"attributes":{"POSITION":0},"material":1}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AACAvwAAgL8AAAAAAABAQAAAgL8AAAAAAACAvwAAQEAAAAAA"}]})");
  const auto scene = load("[[object]]\nmesh = 'two.gltf'\nposition_m = [0, 0, 2]\n");
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_FLOAT_EQ(rangeAhead(*scene), 2.5f);
  const Light light = trace(*scene, requestFor(1, 1, 1.0, {}));
  EXPECT_NEAR(light.truth.albedo(0, 0), 0.9, 1e-6);
  EXPECT_THAT(errorOf("[[object]]\nmesh = 'a.obj'\n"), HasSubstr("this object has no material"));
}

TEST_F(SceneFiles, TheIdCoversContentsAndNothingElse) {
  write("a.obj", "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n");
  const std::string id = loadMesh("a.obj")->id();
  EXPECT_EQ(id.size(), 32u);
  EXPECT_EQ(id.find_first_not_of("0123456789abcdef"), std::string::npos);
  write("b.obj", "# the same under another name\nv -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(loadMesh("b.obj")->id(), id);
  write("a.obj", "v -1 -1 0\nv 1 -1 0\nv 0 1.0001 0\nf 1 2 3\n");
  EXPECT_NE(loadMesh("a.obj")->id(), id);

  const std::string object = "[[object]]\nshape = 'sphere'\nmaterial = 'm'\n";
  const auto idOf = [](const std::string& toml) { return sceneOf(toml).id(); };
  const std::string plain = idOf(kMaterial + object);
  EXPECT_EQ(idOf("# comment\n" + (kMaterial + object)), plain);
  EXPECT_EQ(idOf(kMaterial + object + "radius_m = 0.5\n"), plain) << "the default, written out";
  EXPECT_NE(idOf(kMaterial + object + "radius_m = 0.6\n"), plain);
  EXPECT_NE(idOf(std::string{kMaterial} + "albedo = 0.51\n" + object), plain);
  EXPECT_NE(idOf(kMaterial + object + "[ambient]\nradiance_w_per_m2_sr = 1\n"), plain);
}

struct Placed {
  const char* toml;
  double range_m;
  Vec3d normal;
};

/// The central ray of each shape, 3 m away: range and normal are exact to single precision.
TEST(Shapes, AreWhereTheirNumbersSay) {
  const double h = std::sqrt(0.5);
  const Placed all[] = {
      {"shape = 'sphere'\nradius_m = 0.4", 2.6, {0, 0, -1}},
      {"shape = 'sphere'\nradius_m = 0.2\nscale = 3", 2.4, {0, 0, -1}},
      {"shape = 'disc'", 3.0, {0, 0, -1}},
      {"shape = 'disc'\neuler_deg = [0, 45, 0]", 3.0, {-h, 0, -h}},
      {"shape = 'rectangle'\neuler_deg = [45, 0, 0]", 3.0, {0, h, -h}},
      {"shape = 'rectangle'\nrotation_wxyz = [0.92387953, 0.38268343, 0, 0]", 3.0, {0, h, -h}},
      {"shape = 'box'\nsize_m = [1, 2, 0.5]", 2.75, {0, 0, -1}},
      {"shape = 'box'\nsize_m = [0.5, 2, 9]\neuler_deg = [0, 90, 0]", 2.75, {0, 0, -1}},
      {"shape = 'cylinder'\nradius_m = 0.3\nheight_m = 2", 2.0, {0, 0, -1}},
      {"shape = 'cylinder'\nradius_m = 0.3\nheight_m = 2\neuler_deg = [90, 0, 0]", 2.7, {0, 0, -1}},
  };
  for (const Placed& placed : all) {
    const std::string toml = kMaterial + ("[[object]]\nmaterial = 'm'\nposition_m = [0, 0, 3]\n" + std::string{placed.toml});
    const Light light = trace(sceneOf(toml), requestFor(1, 1, 1.0, {}));
    EXPECT_NEAR(static_cast<double>(light.truth.range_m(0, 0)), placed.range_m, 1e-6) << placed.toml;
    const Vec3f n = light.truth.normal(0, 0);
    EXPECT_NEAR(static_cast<double>(n.x), placed.normal.x, 1e-6) << placed.toml;
    EXPECT_NEAR(static_cast<double>(n.y), placed.normal.y, 1e-6) << placed.toml;
    EXPECT_NEAR(static_cast<double>(n.z), placed.normal.z, 1e-6) << placed.toml;
    EXPECT_FLOAT_EQ(light.truth.albedo(0, 0), 0.5f);
  }
}

TEST(Shapes, EulerAnglesTurnAboutTheFixedAxesXThenYThenZ) {
  const auto file = parseSceneFile(std::string{kMaterial} + "[[object]]\nshape = 'disc'\nmaterial = 'm'\neuler_deg = [90, 30, 80]\n", "s.toml");
  ASSERT_TRUE(file);
  const Vec3d n = file->objects[0].world_from_object.rotate({0, 0, 1});  // z → −y → −y → turned by 80°
  EXPECT_NEAR(n.x, std::sin(80.0 * kPi / 180.0), 1e-12);
  EXPECT_NEAR(n.y, -std::cos(80.0 * kPi / 180.0), 1e-12);
  EXPECT_NEAR(n.z, 0.0, 1e-12);
}

/// The rays of one pixel, in lane 7; another pixel's, beyond a fold or at once there, in the others.
PixelRays raysOfPixel(const CameraInfo& camera, int u, int v) {
  Lanes<int> us, vs;
  for (int i = 0; i < embree::kLanes; ++i) {
    us[static_cast<std::size_t>(i)] = i == 7 ? u : 1000 * i;
    vs[static_cast<std::size_t>(i)] = i == 7 ? v : 0;
  }
  PixelRays rays;
  Lens{camera}.raysOf(us, vs, rays);
  return rays;
}

/// The lens: central rays are exact; the others, by the inverse's derivative, stay within 4e-6 rad half
/// a pixel away (0.15 % of a pixel, in the image's last corner) for a Kinect's lens.
TEST(Lens, FootprintsFollowTheDistortion) {
  const CameraInfo kinect{.width = 512, .height = 424, .fx = 365.456, .fy = 365.456, .cx = 254.88, .cy = 205.40,
                          .distortion = {0.0905, -0.268, 1e-3, -7e-4, 0.0951}, .calibration_id = {}};
  for (int v = 0; v < 424; v += 47) {
    for (int u = 0; u < 512; u += 73) {
      const PixelRays rays = raysOfPixel(kinect, u, v);
      EXPECT_LT(norm(rays.direction(7, 0.0, 0.0) - rayThroughPixel(kinect, u, v).v), 1e-12);
      for (const auto& [du, dv] : {std::pair{0.5, 0.5}, {0.5, -0.5}, {-0.5, 0.5}, {-0.5, -0.5}}) {
        EXPECT_LT(norm(rays.direction(7, du, dv) - rayThroughPixel(kinect, u + du, v + dv).v), 4e-6) << u << " " << v;
      }
    }
  }
}

/// Beyond the place where a distortion folds back, pixels have no ray of their own: the nearest good
/// one, and finite numbers.
TEST(Lens, GivesFiniteRaysBeyondTheFold) {
  CameraInfo fold{.width = 100, .height = 100, .fx = 20.0, .fy = 20.0, .cx = 50.0, .cy = 50.0,
                  .distortion = {-0.5, 0.0, 0.0, 0.0, 0.0}, .calibration_id = {}};
  for (int u = 0; u < 100; u += 9) {
    const Vec3d ray = raysOfPixel(fold, u, 3).direction(7, 0.5, -0.5);
    EXPECT_NEAR(norm(ray), 1.0, 1e-12);
  }
}

TEST(Documents, TheKeyTableIsTheCodes) {
  std::ifstream file{std::string{TOFTWIN_SOURCE_DIR} + "/docs/scene.md"};
  std::ostringstream page;
  page << file.rdbuf();
  const std::string table = settings::markdownTable(settings::keysOf<SceneSpec>());
  EXPECT_NE(page.str().find(table), std::string::npos) << "docs/scene.md must contain:\n" << table;
}

TEST(Documents, EveryExampleSceneLoadsAndShowsSomething) {
  int scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator{std::string{TOFTWIN_SOURCE_DIR} + "/sim/scenes"}) {
    if (entry.path().extension() != ".toml") continue;
    const auto scene = Scene::load(entry.path());
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_TRUE(std::isfinite(rangeAhead(*scene))) << entry.path();
    ++scenes;
  }
  EXPECT_GE(scenes, 3);
}

}  // namespace
}  // namespace toftwin::sim::testing
