// SPDX-License-Identifier: Apache-2.0
// What one camera sees of a plan's walls in one capture.
#include <gmock/gmock.h>

#include <cmath>

#include "calib/plan/run_traits.h"
#include "calib/plan/seen.h"
#include "planted_runs.h"
#include "plans.h"

namespace toftwin::plan {
namespace {

/// The same wall, 5 mm off, before a camera whose pose the rig said and before one whose pose was fitted to it.
TEST(Seen, LeavesErrorsOutWhereThePoseWasFittedToTheCamerasOwnPlanes) {
  const Plan plan = planOf(
      "[[plane]]\npoint_m = [0, 0, 2]\nnormal = [0, 0, -1]\n[[plane]]\npoint_m = [1, 0, 0]\nnormal = [-1, 0, 0]\n"
      "[[plane]]\npoint_m = [0, 1, 0]\nnormal = [0, -1, 0]\n"
      "[[block]]\nname = 'b'\nkind = 'distance'\npose_from = 'planes'\ndistance_m = [1, 1.5, 2]\n");
  Frame frame;
  frame.camera.width = 32, frame.camera.height = 16;
  frame.camera.fx = frame.camera.fy = 20.0, frame.camera.cx = 15.5, frame.camera.cy = 7.5;
  frame.moment.world_from_camera = Transform<World, Camera>{};
  Image<float> range(32, 16);
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 32; ++x)
      range(x, y) = static_cast<float>(2.0 / rayThroughPixel(frame.camera, x, y).v.z + 0.005);
  }
  frame.planes = {toPlane(PlaneKind::Range, std::move(range))};
  compare::Stack stack;
  ASSERT_TRUE(stack.add(frame));
  CaptureRecord record{.block = "b", .kind = "distance"};
  record.pose_by = "rig";
  const std::vector<double> frequency_hz{kFrequency_hz};
  const std::vector<ReadFrame> frames{*readOf(frame)};
  const CameraSeen by_rig = seenOf(plan, record, stack, frames, frequency_hz);
  EXPECT_GT(by_rig.wall_readings, 0.0);
  ASSERT_FALSE(by_rig.wall_error_mm.empty());
  EXPECT_NEAR(by_rig.wall_error_mm.front(), 5.0, 0.01);
  // A pixel of the middle that a second frame has not is in neither mean.
  std::vector<ReadFrame> two{frames[0], frames[0]};
  for (int x = 12; x < 19; ++x) two[1].range_m(x, 7) = std::nanf("");
  for (int x = 12; x < 19; ++x) two[0].range_m(x, 7) = 9.0F;
  const auto middle_m = seenOf(plan, record, stack, two, frequency_hz).middle_range_m;
  ASSERT_EQ(middle_m.size(), 2u);
  EXPECT_EQ(middle_m[0], middle_m[1]);
  EXPECT_NEAR(middle_m[0], 2.0 * std::hypot(1.0, 3.0 / 20.0), 0.1);
  // From where it saw itself, 3 mm behind, the wall is as much farther.
  const Transform<World, Camera> behind{{1.0, 0.0, 0.0, 0.0}, {0.0, 0.0, -0.003}};
  const CameraSeen by_itself = seenOf(plan, record, stack, frames, frequency_hz, behind);
  EXPECT_NEAR(by_itself.wall_error_mm.front(), 5.0 - 3.0 / rayThroughPixel(frame.camera, 3.5, 3.5).v.z, 0.2);
  record.pose_by = "planes";
  const CameraSeen by_planes = seenOf(plan, record, stack, frames, frequency_hz);
  EXPECT_TRUE(by_planes.wall_error_mm.empty() && by_planes.wall_range_m.empty());
  EXPECT_EQ(by_planes.wall_readings, by_rig.wall_readings);
  EXPECT_EQ(by_planes.wall_wraps, by_rig.wall_wraps);
  ComparedRun run = plantedRun();
  run.captures.front().record.pose_by = "planes";
  EXPECT_THAT(traitsOf(run).untold,
              testing::Contains(testing::HasSubstr("errors against the plan's walls at 1 capture (")));
}

}  // namespace
}  // namespace toftwin::plan
