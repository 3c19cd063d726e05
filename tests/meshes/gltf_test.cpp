// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "sim/meshes/gltf_json.h"
#include "tests/meshes/mesh_folder.h"

namespace toftwin::sim::meshes::testing {
namespace {

using ::testing::HasSubstr;

class Gltf : public MeshFolder {
 protected:
  /// One triangle of area 0.5 in a file beside it; `more` goes into the JSON, `nodes` are its nodes.
  [[nodiscard]] std::string triangle(const std::string& nodes, const std::string& more = "", const std::string& uri = "my%20part.bin",
                                     const std::string& primitive = "") const {
    std::string bin;
    for (const float number : {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f}) append(bin, number);
    for (const int index : {0, 1, 2, 0}) append(bin, static_cast<std::uint16_t>(index));
    write("my part.bin", bin);
    return fmt::format(R"({{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1{}}}]}}],
"buffers":[{{"uri":"{}","byteLength":44}}],"bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":6}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},{{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}}]{}}})",
                       nodes, primitive, uri, more);
  }
};

TEST_F(Gltf, ANameWithEscapesIsTheFileBesideIt) {
  const auto mesh = read("space.gltf", triangle(R"({"mesh":0})"));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_DOUBLE_EQ(areaOf(mesh->mesh), 0.5);
}

TEST_F(Gltf, NodesMoveTurnAndScaleWhatIsBelowThem) {
  const auto mesh = read("a.gltf", triangle(R"({"children":[1],"translation":[0,0,5]},
{"mesh":0,"name":"part","rotation":[0,0,0.70710678118654757,0.70710678118654757],"scale":[2,2,2]})"));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_DOUBLE_EQ(areaOf(mesh->mesh), 2.0);
  ASSERT_EQ(mesh->parts.size(), 1u);
  EXPECT_EQ(mesh->parts[0].name, "part");
  EXPECT_NEAR(mesh->mesh.vertices[1].y, 2.0, 1e-12) << "x is turned to y";
  EXPECT_NEAR(mesh->mesh.vertices[1].z, 5.0, 1e-12);
}

TEST_F(Gltf, AMaterialsColourRoughnessAndMetalAreRead) {
  const auto mesh = read("a.gltf", triangle(R"({"mesh":0})", R"(,"materials":[{"name":"steel","pbrMetallicRoughness":
{"baseColorFactor":[0.6,0.5,0.4,1],"metallicFactor":0.9,"roughnessFactor":0.3}},{"extensions":{"KHR_materials_ior":{"ior":1.33}}}])",
                                            "my%20part.bin", R"(,"material":0)"));
  ASSERT_TRUE(mesh) << mesh.error().message;
  ASSERT_EQ(mesh->surfaces.size(), 2u);
  EXPECT_EQ(mesh->surfaces[0].name, "steel");
  EXPECT_EQ(mesh->surfaces[0].base_color, (std::array{0.6, 0.5, 0.4}));
  EXPECT_EQ(mesh->surfaces[0].metallic, 0.9);
  EXPECT_EQ(mesh->surfaces[0].roughness, 0.3);
  EXPECT_EQ(mesh->surfaces[1].metallic, 1.0) << "as glTF has it where nothing is said";
  EXPECT_EQ(mesh->surfaces[1].index, 1.33);
  EXPECT_EQ(mesh->parts[0].surface, 0u);
}

TEST_F(Gltf, ATreeThatIsNoneIsAnErrorAndADeepOneIsRead) {
  EXPECT_THAT(errorOf("a.gltf", triangle(R"({"children":[1]},{"mesh":0,"children":[0]})")), HasSubstr("node 0 has two parents, or is below itself"));
  EXPECT_THAT(errorOf("a.gltf", triangle(R"({"mesh":0,"children":[7]})")), HasSubstr("there is no node 7"));
  std::string chain;
  for (int i = 0; i < 20'000; ++i) chain += fmt::format(R"({{"children":[{}]}},)", i + 1);
  const auto mesh = read("deep.gltf", triangle(chain + R"({"mesh":0})"));
  EXPECT_TRUE(mesh) << mesh.error().message;
}

TEST_F(Gltf, WhatLiesOutsideOfItsBufferIsNotRead) {
  const std::string good = triangle(R"({"mesh":0})");
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string bad = good;
    bad.replace(bad.find(from), from.size(), to);
    return errorOf("a.gltf", bad);
  };
  EXPECT_THAT(changed(R"("count":3,"type":"VEC3")", R"("count":4,"type":"VEC3")"), HasSubstr("accessor 0 of 4 values is longer than its view"));
  EXPECT_THAT(changed(R"("count":3,"type":"VEC3")", R"("count":18446744073709551615,"type":"VEC3")"), HasSubstr("a.gltf"));
  EXPECT_THAT(changed(R"("byteOffset":36)", R"("byteOffset":40)"), HasSubstr("view that is longer than its buffer"));
  EXPECT_THAT(changed(R"("bufferView":0)", R"("bufferView":9)"), HasSubstr("buffer view that is not there"));
  EXPECT_THAT(changed(R"("mesh":0)", R"("mesh":5)"), HasSubstr("mesh 5, which is not there"));
  EXPECT_THAT(changed(R"("indices":1)", R"("indices":0)"), HasSubstr("accessor 0 is of another type"));
  EXPECT_THAT(changed(R"("indices":1)", R"("indices":-7)"), ::testing::Eq("no error")) << "no indices: as they come";
}

TEST_F(Gltf, ExtensionsThatHideTheShapeAreNamed) {
  EXPECT_THAT(errorOf("a.gltf", triangle(R"({"mesh":0})", R"(,"extensionsRequired":["KHR_draco_mesh_compression"])")),
              HasSubstr("KHR_draco_mesh_compression"));
}

TEST_F(Gltf, JsonThatWouldTakeFarMoreMemoryThanTheFileIsNotParsed) {
  EXPECT_EQ(sizeOfJson(R"({"a":[1,2,{"b":"x\",,,["}]})").depth, 3u);
  EXPECT_EQ(sizeOfJson(R"({"buffers":[{"byteLength":1},{"byteLength":2}],"other":[{}]})").buffers, 2u);
  EXPECT_THAT(errorOf("deep.gltf", std::string(100'000, '[')), HasSubstr("nests"));
  EXPECT_THAT(errorOf("long.gltf", R"({"asset":{"version":"2.0"},"x":[)" + std::string(5'000'000, ',')), HasSubstr("values"));
}

}  // namespace
}  // namespace toftwin::sim::meshes::testing
