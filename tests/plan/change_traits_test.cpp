// SPDX-License-Identifier: Apache-2.0
// What changes between frames: lag behind a change of range, plates that move, latency.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "calib/compare/verdict_words.h"
#include "calib/plan/run_traits.h"
#include "calib/plan/seen_plate.h"
#include "planted_runs.h"

namespace toftwin::plan {
namespace {

/// Twelve distances by turns, three more captures of another block. A's frames have 0.3 of the range of the
/// frame before, B's none; each mean errs by 0.2 mm.
TEST(RunTraits, TellWhatTheFirstFramesRangeHasOfTheCaptureBefore) {
  std::mt19937_64 random{kSeed};
  std::normal_distribution<double> error{0.0, 2e-4};
  ComparedRun run;
  double before_m = 1.0;
  for (int i = 0; i < 15; ++i) {
    ComparedCapture& one = run.captures.emplace_back();
    one.record.number = static_cast<std::size_t>(i), one.record.block = i < 12 ? "distance" : "another";
    const double wall_m = i < 12 ? 1.0 + 0.25 * ((5 * i) % 12) : 9.0 - 2.0 * i / 12;
    double seen_m = i == 12 ? wall_m : before_m;  // another scene begins without a frame before
    for (int frame = 0; frame < 10; ++frame) {
      seen_m = wall_m + 0.3 * (seen_m - wall_m);
      one.seen[0].middle_range_m.push_back(seen_m + error(random));
      one.seen[1].middle_range_m.push_back(wall_m + error(random));
    }
    before_m = seen_m;
  }
  const auto toldOf = [&](const char* of) {
    const RunTraits all = traitsOf(run);
    const RunTrait* found = find(all, "lag of the first frame recorded", of, "range left behind");
    return found == nullptr ? compare::Trait{} : found->trait;
  };
  // Of frames 2 to 9, 0.3³ and less is left: (0.3 − 0.3³/0.7/8) / (1 − …) of the change to their mean.
  const double left = std::pow(0.3, 3) / 0.7 / 8.0, told = (0.3 - left) / (1.0 - left);
  const compare::Trait a = toldOf("A"), b = toldOf("B");
  ASSERT_GE(a.n, 9u);
  EXPECT_NEAR(a.value, told, 0.5 * (a.high - a.low));
  EXPECT_LT(a.high - a.low, 0.01);
  ASSERT_GE(b.n, 9u);
  EXPECT_NEAR(b.value, 0.0, 0.5 * (b.high - b.low));
  EXPECT_LT(b.high - b.low, 0.01);
  // Of B, whose ranges are not known, A's row says why there is none.
  ComparedRun without_b = run;
  for (ComparedCapture& one : without_b.captures) one.seen[1].middle_range_m.clear();
  without_b.captures.front().seen[1].starts_s = {0.0, 0.1, 0.2, 0.3, 0.4};
  const auto rows = compare::verdictTable(compare::verdictsOf(traitsOf(without_b))).rows;
  const auto hasKind = [](const auto& row) { return row[0] == "lag of the first frame recorded"; };
  const auto row = std::ranges::find_if(rows, hasKind);
  ASSERT_NE(row, rows.end());
  EXPECT_THAT((*row)[1],
              testing::StartsWith("not told: B has none: range left behind: it takes two captures"));
  for (ComparedCapture& one : run.captures)
    one.record.block = one.record.name = std::to_string(one.record.number);
  EXPECT_THAT(traitsOf(run).untold,
              testing::Contains(testing::HasSubstr(
                  "lag of the first frame recorded of A: range left behind: it takes two captures")));
}

/// Three captures of a plate that goes to and fro by 0.1 m in a second, at 0.4 m/s on the mean, and that two
/// simulated cameras see alike, B `late_s` later in each of them and `of_b` of its way.
ComparedRun movingPlates(std::array<double, 3> late_s, double width_of_b_m, double error_m = 2e-4,
                         double of_b = 1.0) {
  std::mt19937_64 random{kSeed};
  std::normal_distribution<double> error{0.0, error_m};
  ComparedRun run;
  for (std::size_t i = 0; i < 3; ++i) {
    ComparedCapture& one = run.moving.emplace_back();
    one.record.kind = "moving";
    for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
      CameraSeen& seen = one.seen[camera];
      seen.is_simulated = true, seen.plate_pixel_m = 0.01;
      for (int frame = 0; frame < 60; ++frame) {
        const double t = 0.025 * frame + (camera == 1 ? 0.01 : 0.0), late = camera == 1 ? late_s[i] : 0.0;
        seen.plate_time_s.push_back(t);
        const double way_m = camera == 1 ? 0.1 * of_b : 0.1;
        seen.plate_place_m.push_back(way_m * std::sin(2.0 * std::numbers::pi * (t - late)) + error(random));
        seen.plate_width_m.push_back(camera == 1 ? width_of_b_m : 0.3), seen.plate_turn_mm.push_back(0.0);
      }
    }
  }
  return run;
}

TEST(RunTraits, TellNoLatencyThatCapturesDisagreeAboutOrOfPlatesThatLookDifferent) {
  const auto latencyOf = [](const ComparedRun& run) {
    const RunTraits all = traitsOf(run);
    const RunTrait* found = find(all, "latency", "B − A", "latency");
    return found == nullptr ? compare::Trait{} : found->trait;
  };
  const compare::Trait alike = latencyOf(movingPlates({0.02, 0.02, 0.02}, 0.3));
  EXPECT_NEAR(alike.value, 20.0, 0.5 * (alike.high - alike.low));
  EXPECT_LT(alike.high - alike.low, 2.0);
  EXPECT_EQ(alike.doubt, "");
  // By how captures scatter: −97 to 91 ms is no latency.
  const compare::Trait apart = latencyOf(movingPlates({-0.097, 0.0, 0.091}, 0.3));
  EXPECT_LT(apart.low, -50.0);
  EXPECT_GT(apart.high, 50.0);
  // 18 mm less, if at one end, are 9 mm of the middle, 22 ms; 30 mm are three pixels.
  const compare::Trait narrow = latencyOf(movingPlates({0.0, 0.0, 0.0}, 0.282));
  EXPECT_LT(narrow.low, -18.0);
  EXPECT_GT(narrow.high, 18.0);
  EXPECT_EQ(narrow.doubt, "");
  EXPECT_THAT(latencyOf(movingPlates({0.0, 0.0, 0.0}, 0.27)).doubt,
              testing::HasSubstr("the plate is 300 mm wide in A's frames and 270 mm in B's"));
}

/// Places that err by 7 mm: B goes to and fro by 80 mm, at 0.355 m/s (root mean square; of steps of 25 ms 0.3
/// % less); 9 mm are 25.9 ms of that, ± 0.75 by the errors (2000 draws). By A's speed they would be 20.7, by
/// the mean of B's single steps, which the errors lengthen, 21.0.
TEST(RunTraits, WidenLatencyByTheSlowerPlateWhoseSpeedIsNoError) {
  const auto halfOf = [](double width_of_b_m) {
    const RunTraits all = traitsOf(movingPlates({0.0, 0.0, 0.0}, width_of_b_m, 7e-3, 0.8));
    const compare::Trait& latency = find(all, "latency", "B − A", "latency")->trait;
    return 0.5 * (latency.high - latency.low);
  };
  EXPECT_NEAR(halfOf(0.282) - halfOf(0.3), 25.9, 4.0 * 0.75);
  // Steps of 100 mm to and fro from frame to frame are none of the plate's 11 mm at most.
  ComparedRun hidden = movingPlates({0.0, 0.0, 0.0}, 0.282);
  for (ComparedCapture& one : hidden.moving) {
    auto& place_m = one.seen[1].plate_place_m;
    for (std::size_t i = 0; i < place_m.size(); ++i) place_m[i] += i % 2 == 0 ? 0.05 : -0.05;
  }
  const RunTraits all = traitsOf(hidden);
  EXPECT_EQ(find(all, "latency", "B − A", "latency"), nullptr);
  EXPECT_THAT(all.untold, testing::Contains(testing::HasSubstr("places err by so much")));
}

/// B sees all of the way a tenth too long, as where its range errs by the amplitude. A capture of a tenth of a
/// second goes one way only.
TEST(RunTraits, TellNoLatencyOfAnErrorThatGoesWithThePlace) {
  const ComparedRun to_and_fro = movingPlates({0.0, 0.0, 0.0}, 0.3, 2e-4, 1.1);
  const RunTraits told = traitsOf(to_and_fro);
  const RunTrait* latency = find(told, "latency", "B − A", "latency");
  ASSERT_NE(latency, nullptr);
  EXPECT_LT(latency->trait.low, 0.0);
  EXPECT_GT(latency->trait.high, 0.0);
  EXPECT_LT(latency->trait.high - latency->trait.low, 2.0);
  ComparedRun one_way = to_and_fro;
  for (ComparedCapture& one : one_way.moving) {
    for (CameraSeen& seen : one.seen) {
      for (std::vector<double>* column : {&seen.plate_time_s, &seen.plate_place_m, &seen.plate_width_m})
        column->erase(column->begin() + 29, column->end()), column->erase(column->begin(), column->begin() + 12);
      seen.plate_turn_mm.resize(seen.plate_time_s.size());
    }
  }
  EXPECT_THAT(traitsOf(one_way).untold,
              testing::Contains(testing::AllOf(testing::HasSubstr("passes no place in both directions"),
                                               testing::HasSubstr("3 captures of the moving plate"))));
}

/// Nobody who reads a page knows our functions.
TEST(RunTraits, SayInWordsWhyRealCamerasHaveNoLatency) {
  ComparedRun run = movingPlates({0.0, 0.0, 0.0}, 0.3);
  for (ComparedCapture& one : run.moving) one.seen[0].is_simulated = false;
  EXPECT_THAT(traitsOf(run).untold,
              testing::Contains(testing::AllOf(testing::HasSubstr("latency: the two cameras are captured one after"),
                                               testing::Not(testing::HasSubstr("::")))));
}

/// Of two daemons, one of which ran before: no frame of one is at a scene's time of the other's.
TEST(RunTraits, SayWhereTheScenesOfBothHaveNoTimeInCommon) {
  ComparedRun run = movingPlates({0.0, 0.0, 0.0}, 0.3);
  for (ComparedCapture& one : run.moving) {
    for (double& t : one.seen[1].plate_time_s) t += 40.0;
  }
  const RunTraits all = traitsOf(run);
  EXPECT_EQ(find(all, "latency", "B − A", "latency"), nullptr);
  EXPECT_THAT(all.untold, testing::Contains(testing::HasSubstr(
                              "A shows the plate from 0 to 1.475 s of its scene's time, B from 40.01 to 41.48 s")));
}

TEST(RunTraits, SayThatNoFrameShowsAPlateMove) {
  ComparedRun run = plantedRun();
  run.moving.emplace_back().record.kind = "moving";
  EXPECT_THAT(traitsOf(run).untold,
              testing::Contains(testing::HasSubstr("motion of A: in its one capture no two frames")));
}

/// A plate of 8 × 8 pixels one metre before a wall at 2 m goes one pixel, 1/20 of its metre, per frame of 0.1 s.
/// Things in a scene move by the camera's own clock, which its exposures are of; the time since power-on is set from
/// outside, as of a twin that follows, and may be one and the same for all frames.
TEST(MovingPlate, IsTimedByItsExposuresWhateverTheTimeSincePowerOnIs) {
  CameraInfo camera;
  camera.width = 32, camera.height = 16, camera.fx = camera.fy = 20.0, camera.cx = 15.5, camera.cy = 7.5;
  std::vector<ReadFrame> frames(3);
  for (int i = 0; i < 3; ++i) {
    ReadFrame& frame = frames[static_cast<std::size_t>(i)];
    frame.range_m = Image<float>(32, 16, 2.0F);
    for (int y = 4; y < 12; ++y) {
      for (int x = 10 + i; x < 18 + i; ++x) frame.range_m(x, y) = 1.0F;
    }
    frame.start_s = 7.0 + 0.1 * i, frame.since_power_on_s = 500.0;
  }
  CameraSeen seen;
  addMovingPlate(Image<float>(32, 16, 2.0F), camera, frames, seen);
  ASSERT_EQ(seen.plate_time_s.size(), 3u);
  EXPECT_NEAR(seen.plate_time_s[2] - seen.plate_time_s[0], 0.2, 1e-9);
  CameraSeen simulated;
  simulated.is_simulated = true;
  for (std::size_t i = 0; i < 3; ++i) frames[i].since_power_on_s = 600.0 + 0.05 * static_cast<double>(i);
  addMovingPlate(Image<float>(32, 16, 2.0F), camera, frames, simulated);
  EXPECT_EQ(simulated.plate_time_s, seen.plate_time_s);
  for (ReadFrame& frame : frames) frame.start_s.reset();
  CameraSeen without;
  addMovingPlate(Image<float>(32, 16, 2.0F), camera, frames, without);
  EXPECT_EQ(without.plate_time_s, (std::vector{600.0, 600.05, 600.1}));
}

/// Behind a plate that moves, two columns are mixed of it and the wall; one camera masks them. The plate is
/// where it is in both.
TEST(MovingPlate, IsWhereItIsHoweverItsEdgesAreMixedOrMasked) {
  CameraInfo camera;
  camera.width = 32, camera.height = 16, camera.fx = camera.fy = 20.0, camera.cx = 15.5, camera.cy = 7.5;
  std::array<CameraSeen, 3> seen;
  const std::array mixed_m{2.0F, 1.4F, std::nanf("")};
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<ReadFrame> frames(1);
    frames[0].range_m = Image<float>(32, 16, 2.0F), frames[0].start_s = 7.0;
    for (int y = 4; y < 12; ++y) {
      for (int x = 10; x < 18; ++x) frames[0].range_m(x, y) = 1.0F;
      for (int x = 8; x < 10; ++x) frames[0].range_m(x, y) = mixed_m[k];
    }
    addMovingPlate(Image<float>(32, 16, 2.0F), camera, frames, seen[k]);
    ASSERT_EQ(seen[k].plate_place_m.size(), 1u);
    EXPECT_EQ(seen[k].plate_place_m, seen[0].plate_place_m);
    EXPECT_EQ(seen[k].plate_width_m, seen[0].plate_width_m);
  }
  // From pixel 10 to 17, a metre along the rays: x/√(400 + x²) of −5.5 and 1.5 in the middle's rows.
  EXPECT_NEAR(seen[0].plate_place_m.front(), -0.095, 0.002);
  EXPECT_NEAR(seen[0].plate_width_m.front(), 7.0 / 20.0, 0.02);
  EXPECT_DOUBLE_EQ(seen[0].plate_pixel_m, 1.0 / 20.0);
}

}  // namespace
}  // namespace toftwin::plan
