// SPDX-License-Identifier: Apache-2.0
#include "tests/meshes/mesh_folder.h"

namespace toftwin::sim::meshes::testing {
namespace {

using ::testing::HasSubstr;

class Stl : public MeshFolder {};

std::string binary(std::uint32_t said, int there, const std::string& start = "") {
  std::string bytes = start;
  bytes.resize(80, ' ');
  append(bytes, said);
  for (int t = 0; t < there; ++t) {
    for (const float number : {0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f}) append(bytes, number);
    append(bytes, std::uint16_t{0});
  }
  return bytes;
}

TEST_F(Stl, BinaryFilesMayBeginLikeTextFiles) {
  for (const std::string start : {"", "solid part"}) {
    const auto mesh = read("a.stl", binary(2, 2, start));
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_DOUBLE_EQ(areaOf(mesh->mesh), 1.0);
  }
}

TEST_F(Stl, ACountThatTheFileCannotHoldIsRefused) {
  EXPECT_THAT(errorOf("a.stl", binary(3, 2)), HasSubstr("3 triangles, but ends after 2"));
  EXPECT_THAT(errorOf("a.stl", binary(4'294'967'295u, 0)), HasSubstr("ends after 0"));
  EXPECT_THAT(errorOf("a.stl", "short"), HasSubstr("too short"));
}

TEST_F(Stl, TextIsReadAndACutOneIsAnError) {
  const std::string text = "solid part\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid part\n";
  const auto mesh = read("A.STL", text);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_DOUBLE_EQ(areaOf(mesh->mesh), 0.5);
  EXPECT_THAT(errorOf("a.stl", text.substr(0, text.find("endsolid"))), HasSubstr("cut off"));
  EXPECT_THAT(errorOf("a.stl", "solid p\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendsolid\n"), HasSubstr("line 5: a triangle has 2 corners"));
}

}  // namespace
}  // namespace toftwin::sim::meshes::testing
