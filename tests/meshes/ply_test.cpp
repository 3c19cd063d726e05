// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "tests/meshes/mesh_folder.h"

namespace toftwin::sim::meshes::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Ply : public MeshFolder {};

constexpr auto kHeaderEnd = "end_header\n";
const std::string kXyz = "property float x\nproperty float y\nproperty float z\n";
const std::string kList = "property list uchar int vertex_indices\n";

std::string ascii(const std::string& rest) { return "ply\nformat ascii 1.0\n" + rest; }

/// A triangle whose first coordinate's bytes begin with a line feed, so that a reader that skips blanks
/// after the header goes astray.
std::string binaryBeginningWithLineFeed(const std::string& line_end) {
  std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\n" + kXyz + "element face 1\n" + kList + kHeaderEnd, bytes;
  for (const char c : header) bytes += c == '\n' ? line_end : std::string(1, c);
  append(bytes, std::uint32_t{0x3f80000a});  // 1.0000012
  for (const float number : {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f}) append(bytes, number);
  bytes += '\3';
  for (const std::int32_t index : {0, 1, 2}) append(bytes, index);
  return bytes;
}

TEST_F(Ply, DataMayBeginWithAByteThatLooksLikeALinesEnd) {
  for (const std::string line_end : {"\n", "\r\n", "\r"}) {
    const auto mesh = read("a.ply", binaryBeginningWithLineFeed(line_end));
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_FLOAT_EQ(static_cast<float>(mesh->mesh.vertices[0].x), 1.0000012f);
    EXPECT_EQ(mesh->mesh.triangles.size(), 1u);
  }
}

TEST_F(Ply, CutAnywhereItIsAnErrorThatNamesTheFile) {
  const std::string whole = binaryBeginningWithLineFeed("\n");
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_THAT(errorOf("cut.ply", whole.substr(0, size)), HasSubstr("cut.ply")) << size;
  const std::string text = ascii("element vertex 3\n" + kXyz + "element face 1\n" + kList + kHeaderEnd + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  for (std::size_t size = 0; size < text.size() - 2; ++size)
    EXPECT_THAT(errorOf("cut.ply", text.substr(0, size)), HasSubstr("cut.ply")) << size;
}

TEST_F(Ply, BigEndWithDoublesAndOtherElementsIsRead) {
  std::string bytes = "ply\nformat binary_big_endian 1.0\ncomment made by hand\nelement vertex 3\nproperty uchar red\nproperty double x\n"
                      "property double y\nproperty double z\nelement edge 1\nproperty int vertex1\nproperty list uchar short more\n"
                      "element face 1\nproperty list ushort uint vertex_index\nproperty float quality\nend_header\n";
  const auto big = [&](auto value) {
    std::string one;
    append(one, value);
    std::ranges::reverse(one);
    bytes += one;
  };
  for (int i = 0; i < 3; ++i) {
    big(std::uint8_t{200});
    for (const double number : {432123.456 + (i == 1), 812345.678 + (i == 2), 312.5}) big(number);
  }
  big(std::int32_t{0});
  big(std::uint8_t{2});
  big(std::int16_t{1});
  big(std::int16_t{2});
  big(std::uint16_t{3});
  for (const std::uint32_t index : {0u, 1u, 2u}) big(index);
  big(1.0f);
  const auto mesh = read("big.ply", bytes);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->mesh.vertices[0].x, 432123.456) << "double precision is kept";
  EXPECT_NEAR(areaOf(mesh->mesh), 0.5, 1e-9);
}

TEST_F(Ply, ACountThatTheFileCannotHoldIsRefusedBeforeMemoryIsTaken) {
  for (const std::string count : {"4000000000", "9223372036854775807"}) {
    EXPECT_THAT(errorOf("a.ply", ascii("element vertex " + count + "\n" + kXyz + kHeaderEnd + "0 0 0\n")), HasSubstr("too short"));
    EXPECT_THAT(errorOf("b.ply", "ply\nformat binary_little_endian 1.0\nelement vertex " + count + "\n" + kXyz + kHeaderEnd + "1234"),
                HasSubstr("too short"));
    EXPECT_THAT(errorOf("c.ply", ascii("element nothing " + count + "\n" + kHeaderEnd)), HasSubstr("no element \"vertex\""));
  }
  EXPECT_THAT(errorOf("d.ply", ascii("element vertex 1\n" + kXyz + "element face 1\n" + kList + kHeaderEnd + "0 0 0\n999999999 0\n")),
              HasSubstr("row 0 of 1 of element \"face\""));
}

TEST_F(Ply, FacesOfFewCornersAndWithoutAreaAreLeftOutAndSaid) {
  const auto mesh = read("a.ply", ascii("element vertex 4\n" + kXyz + "element face 4\n" + kList + kHeaderEnd +
                                        "0 0 0\n1 0 0\n0 1 0\n2 0 0\n0\n2 0 1\n3 0 1 3\n3 0 1 2\n"));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->mesh.triangles.size(), 1u);
  EXPECT_THAT(mesh->notes, ::testing::ElementsAre(HasSubstr("2 of 4 faces have fewer than three corners"),
                                                  HasSubstr("1 of 2 triangles have no area")));
}

TEST_F(Ply, PointsAloneAreNoSurface) {
  EXPECT_THAT(errorOf("cloud.ply", ascii("element vertex 2\n" + kXyz + kHeaderEnd + "0 0 0\n1 0 0\n")),
              AllOf(HasSubstr("2 points, but no faces"), HasSubstr("cloud.ply")));
  EXPECT_THAT(errorOf("empty.ply", ascii("element vertex 3\n" + kXyz + "element face 1\n" + kList + kHeaderEnd + "0 0 0\n1 0 0\n0 1 0\n0\n")),
              HasSubstr("no face has three corners"));
}

TEST_F(Ply, IndicesThatAreNoVertexAreNamed) {
  for (const std::string index : {"3", "-1", "1.5", "nan", "4294967296"}) {
    EXPECT_THAT(errorOf("a.ply", ascii("element vertex 3\n" + kXyz + "element face 1\n" + kList + kHeaderEnd +
                                       "0 0 0\n1 0 0\n0 1 0\n3 0 1 " + index + "\n")),
                HasSubstr("face 0 refers to vertex " + index)) << index;
  }
}

TEST_F(Ply, StripsBecomeTriangles) {
  const auto mesh = read("a.ply", ascii("element vertex 4\n" + kXyz + "element tristrips 1\nproperty list int int vertex_indices\n" + kHeaderEnd +
                                        "0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 3 -1 0 1 3\n"));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->mesh.triangles.size(), 3u);
  EXPECT_DOUBLE_EQ(areaOf(mesh->mesh), 1.5);
}

TEST_F(Ply, PlacesOnAPictureAreOfVerticesOrOfCorners) {
  const auto of_vertices = read("v.ply", ascii("element vertex 3\n" + kXyz + "property float s\nproperty float t\nelement face 1\n" + kList +
                                               kHeaderEnd + "0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 0.25\n3 0 1 2\n"));
  ASSERT_TRUE(of_vertices) << of_vertices.error().message;
  ASSERT_EQ(of_vertices->mesh.places.size(), 1u);
  EXPECT_EQ(of_vertices->mesh.places[0][2].v, 0.75f) << "from the top down";
  const auto of_corners =
      read("c.ply", ascii("element vertex 3\n" + kXyz + "element face 1\n" + kList + "property list uchar float texcoord\n" + kHeaderEnd +
                          "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0 0 0.5 0 0 1\n"));
  ASSERT_TRUE(of_corners) << of_corners.error().message;
  ASSERT_EQ(of_corners->mesh.places.size(), 1u);
  EXPECT_EQ(of_corners->mesh.places[0][1].u, 0.5f);
}

}  // namespace
}  // namespace toftwin::sim::meshes::testing
