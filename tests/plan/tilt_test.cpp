// SPDX-License-Identifier: Apache-2.0
// By how much B − A goes over the image.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "calib/plan/run_traits.h"

namespace toftwin::plan {
namespace {

constexpr int kTiltedRuns = 40;
/// 95 % of 40: 38. Fewer than 32 are 1.2e-4 by chance; in four counts, 5e-4.
constexpr int kFewestTiltsHeld = 32;

/// Two captures before a wall at each of ten distances. B errs by so much from edge to edge, by 3 mm/m of the range,
/// and each pixel by 3 mm; each condition is turned by 0.3 mm.
ComparedRun tiltedRun(unsigned seed, double right_mm, double down_mm) {
  constexpr int kWidth = 32, kHeight = 24;
  std::mt19937_64 random{seed};
  std::normal_distribution<double> normal{0.0, 1.0};
  ComparedRun run;
  for (std::size_t condition = 0; condition < 10; ++condition) {
    const double middle_m = 0.6 + 0.4 * static_cast<double>(condition), turned_right_mm = 0.3 * normal(random),
                 turned_down_mm = 0.3 * normal(random);
    for (int repeat = 0; repeat < 2; ++repeat) {
      ComparedCapture& one = run.captures.emplace_back();
      one.pixels = 1, one.record.kind = one.record.block = "distance", one.record.condition = condition;
      one.record.number = run.captures.size();
      compare::PoseComparison& seen = one.thinned;
      const Image<float> valid{kWidth, kHeight, 1.0F};
      seen.valid_a = seen.valid_b = seen.range_a_mm = seen.difference_mm = valid;
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          const double right = (x - 15.5) / kWidth, down = (y - 11.5) / kHeight;
          const double range_m = middle_m * std::hypot(1.0, right, down);
          seen.range_a_mm(x, y) = static_cast<float>(1e3 * range_m);
          seen.difference_mm(x, y) =
              static_cast<float>((right_mm + turned_right_mm) * right + (down_mm + turned_down_mm) * down +
                                 3.0 * range_m + 3.0 * normal(random));
        }
      }
    }
  }
  return run;
}

int held(const char* name, double right_mm, double down_mm, double truth_mm) {
  int count = 0;
  for (unsigned seed = 1; seed <= kTiltedRuns; ++seed) {
    for (const RunTrait& one : traitsOf(tiltedRun(seed, right_mm, down_mm)).traits) {
      if (one.what == "tilt over the image" && one.trait.name == name)
        count += one.trait.low <= truth_mm && truth_mm <= one.trait.high && one.trait.high - one.trait.low < 2.0;
    }
  }
  return count;
}

TEST(Tilt, IsWhatWasPlantedFromEdgeToEdge) {
  EXPECT_GE(held("left to right", 4.0, -6.0, 4.0), kFewestTiltsHeld);
  EXPECT_GE(held("top to bottom", 4.0, -6.0, -6.0), kFewestTiltsHeld);
}

TEST(Tilt, IsNoneOfCamerasThatDifferByTheRangeAlone) {
  EXPECT_GE(held("left to right", 0.0, 0.0, 0.0), kFewestTiltsHeld);
  EXPECT_GE(held("top to bottom", 0.0, 0.0, 0.0), kFewestTiltsHeld);
}

TEST(Tilt, IsNotToldOfPosesThatWereSeen) {
  ComparedRun run = tiltedRun(1, 4.0, 0.0);
  run.captures.front().record.pose_half_widths.emplace();
  const RunTraits all = traitsOf(run);
  EXPECT_THAT(all.untold, testing::Contains(testing::HasSubstr("tilt over the image: poses were seen")));
  EXPECT_TRUE(std::ranges::none_of(all.traits, [](const RunTrait& one) { return one.what == "tilt over the image"; }));
}

}  // namespace
}  // namespace toftwin::plan
