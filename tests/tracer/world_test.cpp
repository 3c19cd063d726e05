// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/world_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "sim/tracer/scene.h"
#include "sim/tracer/scene_summary.h"

namespace toftwin::sim::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Worlds : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = ::testing::TempDir() + "worldsXXXXXX";
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream{folder_ / name, std::ios::binary} << text;
    return folder_ / name;
  }
  [[nodiscard]] std::string errorOf(const std::string& name, const std::string& text) const {
    const auto scene = summarise(write(name, text));
    return scene ? "no error" : scene.error().message;
  }
  static void expectAt(const Vec3d& p, double x, double y, double z) {
    EXPECT_NEAR(p.x, x, 1e-9);
    EXPECT_NEAR(p.y, y, 1e-9);
    EXPECT_NEAR(p.z, z, 1e-9);
  }

  std::filesystem::path folder_;
};

constexpr auto kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A world with a ground plane, a turned box with a colour, and an included model with a scaled mesh.
constexpr auto kSdf = R"(<sdf version="1.7"><world name="w">
<model name="ground"><static>true</static><link name="link"><visual name="visual"><geometry><plane><normal>0 0 1</normal><size>10 20</size></plane></geometry></visual></link></model>
<model name="shelf"><pose>1 2 0 0 0 1.5707963267948966</pose><link name="link"><pose>1 0 0 0 0 0</pose>
<visual name="board"><pose>0 0 0.5 0 0 0</pose><geometry><box><size>2 1 0.1</size></box></geometry>
<material><diffuse>0.8 0.4 0.3 1</diffuse></material></visual></link></model>
<include><uri>model://pallet</uri><name>pallet_3</name><pose>5 0 0 0 0 0</pose></include></world></sdf>)";

void writePallet(const std::function<std::filesystem::path(const std::string&, const std::string&)>& write) {
  write("models/pallet/model.config", R"(<model><name>pallet</name><version>1</version><sdf version="1.7">model.sdf</sdf></model>)");
  write("models/pallet/model.sdf", R"(<sdf version="1.7"><model name="pallet"><link name="link"><visual name="visual"><geometry>
<mesh><uri>model://pallet/meshes/part.obj</uri><scale>2 3 1</scale></mesh></geometry></visual></link></model></sdf>)");
  write("models/pallet/meshes/part.obj", kTriangle);
}

TEST_F(Worlds, AnSdfsModelsAreObjectsWithNamesPosesAndSizes) {
  writePallet([&](const std::string& name, const std::string& text) { return write(name, text); });
  const auto scene = summarise(write("warehouse.sdf", kSdf));
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->objects.size(), 3u);
  EXPECT_EQ(scene->objects[0].name, "ground::link::visual");
  expectAt(scene->objects[0].upper_m, 5, 10, 0);
  EXPECT_EQ(scene->objects[1].name, "shelf::link::board");
  expectAt(scene->objects[1].lower_m, 0.5, 2, 0.45);  // turned: its x is the world's y
  expectAt(scene->objects[1].upper_m, 1.5, 4, 0.55);
  EXPECT_EQ(scene->objects[2].name, "pallet_3::link::visual");
  expectAt(scene->objects[2].upper_m, 7, 3, 0);
  EXPECT_EQ(scene->objects[2].triangles, 1u);
  EXPECT_EQ(scene->triangles(), 15u);
}

TEST_F(Worlds, ItsColoursAreAlbedosUnlessTheFileBesideItSaysOtherwise) {
  writePallet([&](const std::string& name, const std::string& text) { return write(name, text); });
  const auto file = write("warehouse.sdf", kSdf);
  const auto albedoOf = [&](std::size_t i) {
    const auto scene = summarise(file);
    EXPECT_TRUE(scene) << scene.error().message;
    for (const MaterialSpec& material : scene->materials) {
      if (material.name == scene->objects[i].material) return material.albedo;
    }
    return -1.0;
  };
  EXPECT_NEAR(albedoOf(1), 0.5, 1e-6);
  EXPECT_NEAR(albedoOf(2), 0.5, 1e-6);
  write("warehouse.sdf.toml", "[[material]]\nmatch = ['pallet*', 'crate*']\nalbedo = 0.35\n");
  EXPECT_NEAR(albedoOf(2), 0.35, 1e-9);
  write("warehouse.sdf.toml", "[[material]]\nalbdo = 0.35\n");
  const auto wrong = summarise(file);
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message, AllOf(HasSubstr("warehouse.sdf.toml:1: match is missing"), HasSubstr("unknown key \"albdo\"")));
}

TEST_F(Worlds, AnSdfIsTraced) {
  writePallet([&](const std::string& name, const std::string& text) { return write(name, text); });
  const auto scene = Scene::load(write("warehouse.sdf", kSdf));
  EXPECT_TRUE(scene) << scene.error().message;
}

TEST_F(Worlds, WhatAnSdfLacksIsNamed) {
  EXPECT_THAT(errorOf("a.sdf", "<sdf"), HasSubstr("a.sdf"));
  EXPECT_THAT(errorOf("b.sdf", R"(<sdf version="1.7"><model name="m"><link name="l"><visual name="v"><geometry><mesh><uri>model://none/a.obj</uri>
</mesh></geometry></visual></link></model></sdf>)"), AllOf(HasSubstr("model://none/a.obj"), HasSubstr("model_path")));
}

/// An arm of 1 m on a base, that turns about y, with a slider at its end.
constexpr auto kUrdf = R"(<robot name="r"><material name="orange"><color rgba="0.9 0.5 0.1 1"/></material>
<link name="base"><visual><geometry><box size="0.2 0.2 0.2"/></geometry><material name="orange"/></visual></link>
<link name="arm"><visual name="rod"><origin xyz="0.5 0 0"/><geometry><box size="1 0.1 0.1"/></geometry></visual></link>
<link name="tip"><visual><geometry><mesh filename="package://robot/meshes/tip.obj" scale="0.1 0.1 0.1"/></geometry></visual></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="slide" type="prismatic"><parent link="arm"/><child link="tip"/><origin xyz="1 0 0"/><axis xyz="1 0 0"/><limit lower="0" upper="0.5" effort="1" velocity="1"/></joint>
</robot>)";

TEST_F(Worlds, AUrdfsJointsCanBeSet) {
  write("robot/meshes/tip.obj", kTriangle);
  const auto file = write("robot/urdf/r.urdf", kUrdf);
  const auto straight = summarise(file);
  ASSERT_TRUE(straight) << straight.error().message;
  ASSERT_EQ(straight->objects.size(), 3u);
  EXPECT_EQ(straight->objects[1].name, "arm::rod");
  expectAt(straight->objects[1].upper_m, 1, 0.05, 1.05);
  expectAt(straight->objects[2].lower_m, 1, 0, 1);
  write("robot/urdf/r.urdf.toml", "[[joint]]\nname = 'shoulder'\nposition = -1.5707963267948966\n[[joint]]\nname = 'slide'\nposition = 0.25\n");
  const auto up = summarise(file);
  ASSERT_TRUE(up) << up.error().message;
  expectAt(up->objects[1].upper_m, 0.05, 0.05, 2);
  expectAt(up->objects[2].lower_m, 0, 0, 2.25);
}

TEST_F(Worlds, AJointThatCannotStandThereIsNamed) {
  write("robot/meshes/tip.obj", kTriangle);
  const auto file = write("robot/urdf/r.urdf", kUrdf);
  write("robot/urdf/r.urdf.toml", "[[joint]]\nname = 'shoulder'\nposition = 3\n[[joint]]\nname = 'elbow'\n");
  const auto scene = summarise(file);
  ASSERT_FALSE(scene);
  EXPECT_THAT(scene.error().message, AllOf(HasSubstr("there is no joint \"elbow\"; there are: shoulder, slide"), HasSubstr("beyond its limits, -2 to 2")));
  EXPECT_THAT(errorOf("no.urdf", "<robot name='r'/>"), HasSubstr("no.urdf: this is no URDF"));
}

TEST_F(Worlds, AGltfsNodesAreObjects) {
  const auto file = write("room.gltf",
      R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0,1]}],"nodes":[{"mesh":0,"name":"floor"},{"mesh":0,"name":"crate.001","translation":[0,0,1.5]}],
"materials":[{"name":"paper","pbrMetallicRoughness":{"baseColorFactor":[0.9,0.9,0.9,1],"metallicFactor":0}}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AACAvwAAgL8AAAAAAABAQAAAgL8AAAAAAACAvwAAQEAAAAAA"}]})");
  write("room.gltf.toml", "[[material]]\nname = 'wood'\nmatch = ['crate*']\nalbedo = 0.6\n");
  const auto scene = summarise(file);
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->objects.size(), 2u);
  EXPECT_EQ(scene->objects[0].name, "floor");
  EXPECT_EQ(scene->objects[0].material, "paper");
  EXPECT_EQ(scene->objects[1].material, "wood");
  expectAt(scene->objects[1].lower_m, -1, -1, 1.5);
  const auto built = Scene::load(file);
  EXPECT_TRUE(built) << built.error().message;
}

}  // namespace
}  // namespace toftwin::sim::testing
