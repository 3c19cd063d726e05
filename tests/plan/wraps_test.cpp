// SPDX-License-Identifier: Apache-2.0
// A wall farther than a camera can tell: counted as wrapped, and no error of the camera.
#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include <fmt/format.h>

#include "calib/plan/run_traits.h"
#include "plans.h"

namespace toftwin::plan {
namespace {

constexpr double kLight_hz = 20e6, kTurn_m = 299'792'458.0 / 2.0 / kLight_hz;
constexpr unsigned kWrapSeed = 20261123;

/// A wall at z = 2 m, seen from `distance_m` before it by a camera without errors and with noise of 50 mm.
struct WallSeen {
  CameraSeen seen{};
  double readings = 0.0, wraps = 0.0;  ///< as they were made
};

WallSeen wallFrom(double distance_m, std::size_t number, bool has_size) {
  const Plan plan =
      planOf(std::string{"target_m = [0, 0, 2]\n"} + (has_size ? "target_size_m = [40, 40]\n" : "") +
             "[[block]]\nname = 'b'\nkind = 'distance'\ndistance_m = [1, 1.5, 2]\n");
  std::mt19937_64 random{kWrapSeed + number};
  std::normal_distribution<double> noise_m{0.0, 0.05};
  Frame frame;
  frame.camera.width = 64, frame.camera.height = 48;
  frame.camera.fx = frame.camera.fy = 52.0, frame.camera.cx = 31.5, frame.camera.cy = 23.5;
  frame.moment.world_from_camera =
      Transform<World, Camera>{{1.0, 0.0, 0.0, 0.0}, {0.0, 0.0, 2.0 - distance_m}};
  WallSeen made;
  compare::Stack stack;
  std::vector<ReadFrame> frames;
  for (int i = 0; i < 6; ++i) {
    Image<float> range(64, 48);
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        const double truth = distance_m / rayThroughPixel(frame.camera, x, y).v.z,
                     read = truth + noise_m(random);
        range(x, y) = static_cast<float>(read - kTurn_m * std::floor(read / kTurn_m));
        ++made.readings, made.wraps += read >= kTurn_m;
      }
    }
    frame.planes = {toPlane(PlaneKind::Range, std::move(range))};
    EXPECT_TRUE(stack.add(frame));
    frames.push_back(*readOf(frame));
  }
  const CaptureRecord record{.number = number, .block = "b", .kind = "distance"};
  made.seen = seenOf(plan, record, stack, frames, std::vector{kLight_hz});
  return made;
}

/// 6.6 m wraps in the image's corners, 9.5 m all over. A reading that noise took over 0 is not told from one
/// behind.
TEST(Wraps, AreCountedOfAllReadingsOfTheWall) {
  for (const bool has_size : {false, true}) {
    const WallSeen near = wallFrom(2.0, 0, has_size), part = wallFrom(6.6, 1, has_size),
                   far = wallFrom(9.5, 2, has_size);
    EXPECT_EQ(near.seen.wall_readings, near.readings);
    EXPECT_EQ(near.seen.wall_wraps, 0.0);
    EXPECT_GT(part.wraps, 0.1 * part.readings);
    EXPECT_EQ(part.seen.wall_readings, part.readings);
    EXPECT_EQ(part.seen.wall_wraps, part.wraps);
    EXPECT_EQ(far.seen.wall_wraps, far.readings);
    EXPECT_TRUE(far.seen.wall_error_mm.empty());
    EXPECT_TRUE(isWrapped(far.seen) && isWrapped(part.seen) && !isWrapped(near.seen));
  }
}

/// What noise does not take over the period reads too near: cells of which a part wraps are no errors.
TEST(Wraps, LeaveNoErrorBehindInCellsThatWrapInPart) {
  const WallSeen part = wallFrom(6.6, 1, true);
  ASSERT_FALSE(part.seen.wall_error_mm.empty());
  // The mean of a cell of 64 pixels in six frames: 50 mm / √384 = 2.6 mm; five of them are 6e-7 for each of
  // 48 cells. A share of 1 % cut off shifts it by 1.3 mm more.
  for (const double error_mm : part.seen.wall_error_mm) EXPECT_NEAR(error_mm, 0.0, 5.0 * 2.6 + 1.3);
}

TEST(Wraps, AreNoWavesOfTheCameraAndWhatIsLeftOutIsSaid) {
  ComparedRun run;
  run.frequency_hz = {std::vector{kLight_hz}, std::vector{kLight_hz}};
  double readings = 0.0, wraps = 0.0;
  for (const double distance_m : {0.7, 1.0, 1.4, 1.8, 2.3, 2.9, 3.6, 4.4, 5.4, 6.6, 9.5}) {
    const std::size_t number = run.captures.size();
    const WallSeen made = wallFrom(distance_m, number, true);
    ComparedCapture one;
    one.pixels = 15, one.range_a_mm = 1e3 * distance_m;
    // B − A of pixels that both wrap is small, at a range at which no wall stands.
    one.difference_mm = distance_m > 6.0 ? 500.0 : 0.0;
    one.record.number = number, one.record.name = fmt::format("{} m", distance_m);
    one.record.block = "b", one.record.kind = "distance";
    one.thinned.valid_a = one.thinned.valid_b = Image<float>(4, 4, 1.0F);
    one.seen = {made.seen, made.seen};
    readings += made.readings, wraps += made.wraps;
    run.captures.push_back(one);
  }
  const RunTraits all = traitsOf(run);
  std::size_t waves = 0;
  for (const RunTrait& one : all.traits) {
    if (one.what == "wraps") {
      EXPECT_NEAR(one.trait.value, wraps / readings, 1e-12);
    }
    if (!one.what.starts_with("harmonics") || !one.trait.name.ends_with("per period")) continue;
    ++waves;
    EXPECT_LT(one.trait.low, 1.0) << one.what << ' ' << one.of << ' ' << one.trait.name;
  }
  EXPECT_GT(waves, 0u);
  for (const char* whose : {"harmonics of A at 6.6 m; 9.5 m: 2 of 11 captures are left out",
                            "harmonics of B at 6.6 m; 9.5 m: 2 of 11 captures are left out",
                            "harmonics of B − A at 6.6 m; 9.5 m: 2 of 11 captures are left out"})
    EXPECT_THAT(all.untold, testing::Contains(testing::HasSubstr(whose)));
}

}  // namespace
}  // namespace toftwin::plan
