// SPDX-License-Identifier: Apache-2.0
// The use cases that ship, and objects in pixels.
#include "cases.h"
#include "sim/tracer/objects.h"

namespace toftwin::suit {
namespace {

TEST(Examples, AreReadAndTheirObjectsAreSeenFromTheirPoses) {
  for (const char* name : {"pallet", "person"}) {
    const auto use = loadCase(fmt::format("{}/docs/examples/suit/{}.toml", TOFTWIN_SOURCE_DIR, name));
    ASSERT_TRUE(use) << use.error().message;
    const auto scene = sim::Scene::load(use->scene_file);
    ASSERT_TRUE(scene) << scene.error().message;
    const CameraInfo camera{.width = 160,
                            .height = 120,
                            .fx = 130,
                            .fy = 130,
                            .cx = 79.5,
                            .cy = 59.5,
                            .distortion = {},
                            .calibration_id = {}};
    for (const auto& requirement : use->spec.requirements) {
      if (requirement.kind == Kind::FrameRate) continue;
      for (std::size_t pose = 0; pose < use->spec.poses.size(); ++pose) {
        if (!concerns(requirement, *use, pose, 0) && !concerns(requirement, *use, pose, 1)) continue;
        const auto& station = use->spec.poses[pose];
        const Seen seen = seenFrom(*scene, camera, station.world_from_camera(), station.time);
        EXPECT_GE(pixelsOf(requirement, *use, seen).size(), 10u)
            << name << ": " << requirement.name << " at " << station.name;
      }
    }
  }
}

/// Where a central ray meets the box by the tracer's own truth, its object is the box; beyond it the wall;
/// and the object of a scene that moves is where it is then.
TEST(ObjectsSeen, AreThoseWhoseRangeThePixelHas) {
  const Folder folder;
  folder.write("moving.toml", R"(
[[material]]
name = "grey"
[[object]]
name = "wall"
shape = "rectangle"
size_m = [6, 6, 0]
position_m = [0, 0, 2]
material = "grey"
[[object]]
name = "ball"
shape = "sphere"
radius_m = 0.2
position_m = [-1, 0, 1.5]
velocity_m_per_s = [1, 0, 0]
material = "grey"
)");
  const auto scene = sim::Scene::load(folder.path() / "moving.toml");
  ASSERT_TRUE(scene) << scene.error().message;
  const CameraInfo camera{.width = 33,
                          .height = 24,
                          .fx = 26,
                          .fy = 26,
                          .cx = 16,
                          .cy = 11.5,
                          .distortion = {},
                          .calibration_id = {}};
  const Seen seen = seenFrom(*scene, camera, {}, 1_s);
  std::size_t balls = 0;
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 33; ++x) {
      const double depth = seen.range_m(x, y) * rayThroughPixel(camera, x, y).v.z;
      EXPECT_EQ(seen.object(x, y), depth < 1.9 ? 1 : 0) << x << ", " << y;
      balls += seen.object(x, y) == 1 ? 1 : 0;
    }
  }
  // A disc of atan-radius 0.2/1.5: π (26 · 0.1345)² = 38 pixels; those on its rim may be ten more or fewer.
  EXPECT_NEAR(static_cast<double>(balls), 38.0, 10.0);
  EXPECT_EQ(seen.object(16, 11), 1);
}

TEST(ObjectsSeen, AreNoneWhereNothingIs) {
  const Folder folder;
  const auto scene = sim::Scene::load(folder.path() / "scene.toml");
  const CameraInfo camera{.width = 17,
                          .height = 2,
                          .fx = 10,
                          .fy = 10,
                          .cx = 8,
                          .cy = 0.5,
                          .distortion = {},
                          .calibration_id = {}};
  Transform<World, Camera> away;
  away.rotation_wxyz = {0.0, 0.0, 1.0, 0.0};  // about y by half a turn
  const auto objects = sim::objectsSeen(*scene, camera, away);
  EXPECT_THAT(objects.pixels(), testing::Each(-1));
}

}  // namespace
}  // namespace toftwin::suit
