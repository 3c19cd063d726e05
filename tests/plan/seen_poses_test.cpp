// SPDX-License-Identifier: Apache-2.0
// Errors over distance where the poses are of a board that was seen: repeats of a condition share what it errs by.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <random>

#include "calib/plan/run_traits.h"

namespace toftwin::plan {
namespace {

constexpr double kSeenAt_hz = 25e6;
constexpr int kBoards = 40;

/// What a pose errs by at a distance: 1 mm at 1.2 m and as its cube, as of a board of so many pixels.
double poseError_mm(double distance_m) { return std::pow(distance_m / 1.2, 3.0); }

/// Two captures before a wall at each of so many distances from 1.2 m to 2.1 m, by cameras without errors: each
/// condition is off by `off(distance)` in A's frames and has a slope of `turned_mm_per_m`, each step by 0.1 mm.
ComparedRun seenRun(unsigned seed, int conditions, const std::function<double(double)>& off_mm,
                    double turned_mm_per_m = 0.0) {
  std::mt19937_64 random{seed};
  std::normal_distribution<double> step_mm{0.0, 0.1};
  ComparedRun run;
  run.frequency_hz = {std::vector{kSeenAt_hz}, std::vector{kSeenAt_hz}};
  for (int c = 0; c < conditions; ++c) {
    const double middle_m = 1.2 + 0.9 * c / std::max(1, conditions - 1), shared_mm = off_mm(middle_m),
                 slope_mm_per_m = 10.0 * turned_mm_per_m * step_mm(random);
    for (int repeat = 0; repeat < 2; ++repeat) {
      ComparedCapture& one = run.captures.emplace_back();
      one.pixels = 1, one.record.kind = one.record.block = "distance", one.record.number = run.captures.size();
      one.record.condition = static_cast<std::size_t>(c), one.record.pose_half_widths.emplace();
      one.pose_error_mm = {poseError_mm(middle_m), 0.0};
      for (double d = middle_m; d < 1.2 * middle_m; d += 0.025) {
        const double turned_mm = slope_mm_per_m * (d - 1.1 * middle_m);
        one.seen[0].wall_steps.add(d, shared_mm + turned_mm + step_mm(random));
        one.seen[1].wall_steps.add(d, step_mm(random));
      }
    }
  }
  return run;
}

std::optional<compare::Trait> ofA(const RunTraits& all, std::string_view name) {
  for (const RunTrait& one : all.traits) {
    if (one.what == kHarmonicsOfWall && one.of == "A" && one.trait.name == name) return one.trait;
  }
  return std::nullopt;
}

/// In how many of kBoards runs a number that is 0 is not told to be another, where poses turn walls by 10 mm/m.
/// `errs`: what one board errs by over the distance, of its standard error.
int heldAtZero(const char* name, int conditions,
               const std::function<std::function<double(double)>(std::mt19937_64&)>& errs) {
  int count = 0;
  for (unsigned seed = 1; seed <= kBoards; ++seed) {
    std::mt19937_64 random{1000 + seed};
    const auto of_board = errs(random);
    const auto off_mm = [&](double d) { return of_board(d) * poseError_mm(d); };
    const auto found = ofA(traitsOf(seenRun(seed, conditions, off_mm, 10.0)), name);
    count += found && (!found->doubt.empty() || (found->low <= 0.0 && 0.0 <= found->high));
  }
  return count;
}

/// 95 % of 40: 38. Fewer than 32 are 1.2e-4 by chance.
constexpr int kFewestHeld = 32;

TEST(SeenPoses, LeaveCamerasWithoutErrorsWithoutAScale) {
  const auto anew = [](std::mt19937_64& random) -> std::function<double(double)> {
    return [&random](double) { return std::normal_distribution<double>{}(random); };
  };
  const auto the_same_way = [](std::mt19937_64& random) -> std::function<double(double)> {
    const double all = std::normal_distribution<double>{}(random);
    return [all](double) { return all; };
  };
  for (const int conditions : {4, 9}) {
    for (const char* name : {"scale", "offset"}) {
      EXPECT_GE(heldAtZero(name, conditions, anew), kFewestHeld) << name << ' ' << conditions;
      EXPECT_GE(heldAtZero(name, conditions, the_same_way), kFewestHeld) << name << ' ' << conditions;
    }
  }
}

/// Two conditions of two captures each are two, not four; three tell more, but what two say of how the third
/// differs is not enough.
TEST(SeenPoses, AreTooFewWhereTwoConditionsWereCapturedTwice) {
  const auto none = [](double) { return 0.0; };
  const auto scale = ofA(traitsOf(seenRun(1, 2, none)), "scale");
  ASSERT_TRUE(scale);
  EXPECT_EQ(scale->doubt, "it is from 2 poses that were seen only, and it takes three");
  ComparedRun put = seenRun(1, 4, none);
  EXPECT_EQ(ofA(traitsOf(put), "scale")->doubt, "");
  for (ComparedCapture& one : put.captures) one.record.pose_half_widths.reset(), one.pose_error_mm = {};
  const auto known = ofA(traitsOf(put), "scale"), seen = ofA(traitsOf(seenRun(1, 4, none)), "scale");
  // Of a pose that is known the scale is, too: to far less than 1 mm over a metre.
  EXPECT_LT(known->high - known->low, 0.5);
  EXPECT_GT(seen->high - seen->low, 1.0);
}

/// Four poses before a wall, each known to 1 mm and turned, with a wave of A's of four per period of 100 MHz.
ComparedRun wavyRun(double wave_mm) {
  constexpr double kFast_hz = 100e6, kWaves_per_m = 4.0 * 2.0 * kFast_hz / 299792458.0;
  std::mt19937_64 random{7};
  std::normal_distribution<double> of_step_mm{0.0, 0.01}, of_pose_mm{0.0, 1.0};
  ComparedRun run;
  run.frequency_hz = {std::vector{kFast_hz}, std::vector{kFast_hz}};
  for (std::size_t c = 0; c < 4; ++c) {
    ComparedCapture& one = run.captures.emplace_back();
    one.pixels = 1, one.record.kind = one.record.block = "distance", one.record.number = c + 1;
    one.record.condition = c, one.record.pose_half_widths.emplace(), one.pose_error_mm = {1.0, 1.0};
    const double begin_m = 1.0 + 0.3 * static_cast<double>(c), off_mm = of_pose_mm(random);
    for (double d = begin_m; d < begin_m + 0.8; d += 0.025) {
      const double wave = wave_mm * std::sin(2.0 * std::numbers::pi * kWaves_per_m * d);
      one.seen[0].wall_steps.add(d, off_mm * (d - begin_m) + wave + of_step_mm(random));
      one.seen[1].wall_steps.add(d, of_step_mm(random));
    }
  }
  return run;
}

/// Seven of seven pairs of equal cameras differed by waves of 0.14 mm that their poses' turns had bent.
TEST(SeenPoses, LeaveWavesInDoubtThatAreSmallerThanWhatTheyAreKnownTo) {
  const char* name = "100 MHz, 4 per period";
  const auto small = ofA(traitsOf(wavyRun(0.2)), name), large = ofA(traitsOf(wavyRun(3.0)), name);
  ASSERT_TRUE(small && large);
  EXPECT_NEAR(small->value, 0.2, 0.1);
  EXPECT_THAT(small->doubt, testing::HasSubstr("known to 1 mm at the wall"));
  EXPECT_NEAR(large->value, 3.0, 0.1);
  EXPECT_EQ(large->doubt, "");
}

}  // namespace
}  // namespace toftwin::plan
