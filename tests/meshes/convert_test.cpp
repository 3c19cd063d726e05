// SPDX-License-Identifier: Apache-2.0
#include "sim/meshes/convert.h"

#include "tests/meshes/mesh_folder.h"

namespace toftwin::sim::meshes::testing {
namespace {

using ::testing::HasSubstr;

class Converted : public MeshFolder {};

/// A triangle in the Object File Format, which no reader of ours knows.
constexpr auto kOff = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

TEST_F(Converted, OtherFormatsAreReadOnlyWhereThatIsAllowed) {
  const auto file = write("a.off", kOff);
  const auto refused = readMeshFile(file);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Error::Code::Unsupported);
  EXPECT_THAT(refused.error().message, HasSubstr("convert_meshes"));
  const auto mesh = readMeshFile(file, {.stop = {}, .may_convert = true});
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_DOUBLE_EQ(areaOf(mesh->mesh), 0.5);
}

TEST_F(Converted, WhatCannotBeConvertedIsAnError) {
  const auto mesh = readMeshFile(write("a.dae", "<COLLADA>"), {.stop = {}, .may_convert = true});
  ASSERT_FALSE(mesh);
  EXPECT_THAT(mesh.error().message, HasSubstr("Assimp cannot read it"));
}

TEST_F(Converted, EndsWhenAskedTo) {
  const auto mesh = readMeshFile(write("a.off", kOff), {.stop = stoppedToken(), .may_convert = true});
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().code, Error::Code::Stopped);
}

}  // namespace
}  // namespace toftwin::sim::meshes::testing
