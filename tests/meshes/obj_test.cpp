// SPDX-License-Identifier: Apache-2.0
#include "tests/meshes/mesh_folder.h"

namespace toftwin::sim::meshes::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Obj : public MeshFolder {};

constexpr auto kL = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\n";

TEST_F(Obj, APolygonWithANotchKeepsItsAreaFromWhicheverCornerItBegins) {
  for (const std::string face : {"1 2 3 4 5 6", "2 3 4 5 6 1", "3 4 5 6 1 2", "4 5 6 1 2 3", "6 5 4 3 2 1", "3 2 1 6 5 4"}) {
    const auto mesh = read("l.obj", kL + ("f " + face) + "\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->mesh.triangles.size(), 4u);
    EXPECT_DOUBLE_EQ(areaOf(mesh->mesh), 3.0) << face;
  }
}

TEST_F(Obj, CoordinatesKeepDoublePrecision) {
  const auto mesh = read("site.obj", "v 432123.456 812345.678 312.500\nv 432123.756 812345.678 312.5\nv 432123.456 812345.978 312.5\nf 1 2 3\n");
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->mesh.vertices[0].x, 432123.456);
  EXPECT_EQ(mesh->mesh.vertices[2].y, 812345.978);
}

TEST_F(Obj, IndicesMayCountBackwardsComeEarlyAndNamePlaces) {
  const auto mesh = read("a.obj", "\xef\xbb\xbf# written by hand\r\nf 1/1/1 2/2/1 3/3/1\r\nv 0 0 0 1.0\r\nv +1.0e0 0 0\r\nv 0 1 0\r\n"
                                  "vt 0 0\r\nvt 1 0\r\nvt 0 1 0\r\nf -3/-3 -2/-2 \\\r\n -1/-1\r\n");
  ASSERT_TRUE(mesh) << mesh.error().message;
  ASSERT_EQ(mesh->mesh.triangles.size(), 2u);
  EXPECT_EQ(mesh->mesh.triangles[0], mesh->mesh.triangles[1]);
  ASSERT_EQ(mesh->mesh.places.size(), 2u);
  EXPECT_EQ(mesh->mesh.places[1][0].v, 1.0f);
  EXPECT_EQ(mesh->mesh.places[1][2].v, 0.0f);
}

TEST_F(Obj, WhatIsWrongIsNamedWithItsLine) {
  EXPECT_THAT(errorOf("a.obj", "v 0 0 0\nv 1 0\n"), AllOf(HasSubstr("a.obj"), HasSubstr("line 2"), HasSubstr("three numbers")));
  EXPECT_THAT(errorOf("a.obj", "v 0 0 0\nv 1 0,5 0\n"), HasSubstr("\"0,5\" is none"));
  EXPECT_THAT(errorOf("a.obj", "v 0 0 0\nf 0 1 2\n"), HasSubstr("\"0\" is no index"));
  EXPECT_THAT(errorOf("a.obj", "v 0 0 0\nf -2 1 1\n"), HasSubstr("\"-2\" is no index"));
  EXPECT_THAT(errorOf("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"), HasSubstr("face 0 refers to vertex 3, but there are 3"));
  EXPECT_THAT(errorOf("a.obj", "v 0 0 0\nv 1e400 0 0\nv 0 1 0\nf 1 2 3\n"), HasSubstr("vertex 1 is not finite"));
  EXPECT_THAT(errorOf("a.obj", "v 0 0 0\nv 1e30 0 0\nv 0 1 0\nf 1 2 3\n"), HasSubstr("as far as can be"));
}

TEST_F(Obj, CurvesAreLeftOutAndSaid) {
  const auto mesh = read("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nl 1 2\np 1\ncurv 0 1 1 2\n");
  ASSERT_TRUE(mesh);
  EXPECT_THAT(mesh->notes, ::testing::ElementsAre(HasSubstr("1 free-form curves")));
}

TEST_F(Obj, ReadingEndsSoonWhenAskedTo) {
  std::string bytes = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  for (int i = 0; i < 100'000; ++i) bytes += "f 1 2 3\n";
  const auto mesh = readMeshFile(write("a.obj", bytes), {.stop = stoppedToken(), .may_convert = false});
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().code, Error::Code::Stopped);
}

}  // namespace
}  // namespace toftwin::sim::meshes::testing
