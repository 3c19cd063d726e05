// SPDX-License-Identifier: Apache-2.0
// Waves over distance that a run's walls tell of each camera.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "calib/plan/captures.h"
#include "calib/plan/run_traits.h"
#include "planted_runs.h"

namespace toftwin::plan {
namespace {

/// B has another wave of its own, 3 mm four times per period of its frequency.
TEST(RunTraits, TakeEachCamerasHarmonicsByItsOwnFrequencies) {
  ComparedRun run = plantedRun();
  const double other_hz = 40e6, period_m = 299'792'458.0 / 2.0 / other_hz;
  run.frequency_hz[1] = {other_hz};
  std::mt19937_64 random{kSeed};
  std::normal_distribution<double> error{0.0, 0.1};
  for (ComparedCapture& one : run.captures) {
    const double d_m = one.range_a_mm / 1000.0;
    one.seen[0].wall_steps.add(d_m, 2.0 * std::cos(8.0 * std::numbers::pi * d_m / kPeriod_m) + error(random));
    one.seen[1].wall_steps.add(d_m, 3.0 * std::cos(8.0 * std::numbers::pi * d_m / period_m) + error(random));
  }
  const RunTraits all = traitsOf(run);
  expectNear(find(all, "harmonics, against", "A", "30 MHz, 4 per period"), 2.0);
  expectNear(find(all, "harmonics, against", "B", "40 MHz, 4 per period"), 3.0);
  EXPECT_EQ(find(all, "harmonics", "B − A", "30 MHz, 4 per period"), nullptr);
  EXPECT_THAT(all.untold, testing::Contains(testing::HasSubstr(
                              "harmonics of B − A: A is modulated at 30 MHz, B at 40 MHz")));
  run.frequency_hz[1] = {kFrequency_hz * 1.0005};
  EXPECT_NE(find(traitsOf(run), "harmonics", "B − A", "30 MHz, 4 per period"), nullptr);
}

/// Twenty walls, each captured twice, and between both captures nothing changes but noise of 0.01 mm: a traced light's
/// grain, 0.5 mm of each wall, is the same. Of two simulated cameras the two are one row; others err anew each time.
TEST(RunTraits, CountRepeatsOfTwoSimulatedCamerasOnce) {
  std::mt19937_64 random{kSeed};
  std::normal_distribution<double> error{0.0, 1.0};
  ComparedRun run = plantedRun();
  std::erase_if(run.captures, [](const ComparedCapture& one) { return one.record.kind == "warm_up"; });
  double grain_mm = 0.0;
  for (std::size_t i = 0; i < run.captures.size(); ++i) {
    if (i % 2 == 0) grain_mm = 0.5 * error(random);
    ComparedCapture& one = run.captures[i];
    one.record.block = "distance", one.record.condition = i / 2;
    one.range_a_mm = 500.0 + 200.0 * static_cast<double>(i / 2);
    one.difference_mm = 3.0 + grain_mm + 0.01 * error(random);
  }
  const auto rowsOf = [&](bool is_simulated) {
    for (ComparedCapture& one : run.captures) one.seen[0].is_simulated = one.seen[1].is_simulated = is_simulated;
    const RunTraits all = traitsOf(run);
    const RunTrait* scale = find(all, "harmonics", "B − A", "scale");
    return scale == nullptr ? 0 : scale->trait.n;
  };
  EXPECT_EQ(rowsOf(true), 20u);
  EXPECT_EQ(rowsOf(false), 40u);
}

const std::vector<double> kKinect_hz{16e6, 80e6, 120e6};

/// The open captures of the standard plan, and two at each of `more_m`, before a wall that fills 60° of a
/// Kinect v2's image: it errs by `wave_mm`, each capture by 0.3 mm of its own and each cell by as much.
ComparedRun wallsOfTheStandardPlan(const std::function<double(double)>& wave_mm,
                                   const std::vector<double>& more_m = {}) {
  const auto plan = loadPlan(TOFTWIN_SOURCE_DIR "/docs/examples/plans/standard.toml");
  const auto schedule = scheduleOf(*plan);
  std::vector<double> distance_m;
  for (const PlannedCapture& planned : schedule->captures) {
    if (plan->blocks[planned.block].kind == Kind::Distance && !planned.is_locked)
      distance_m.push_back(planned.distance_m);
  }
  for (int repeat = 0; repeat < 2; ++repeat)
    distance_m.insert(distance_m.end(), more_m.begin(), more_m.end());
  std::mt19937_64 random{kSeed};
  std::normal_distribution<double> error{0.0, 0.3};
  ComparedRun run;
  run.frequency_hz = {kKinect_hz, kKinect_hz};
  for (const double middle_m : distance_m) {
    ComparedCapture& one = run.captures.emplace_back();
    one.pixels = 1, one.record.kind = "distance", one.record.number = run.captures.size();
    const double own = error(random);
    for (double tangent = 0.0; tangent < 0.577; tangent += 0.01) {
      const double d = middle_m * std::hypot(1.0, tangent);
      for (CameraSeen& seen : one.seen) {
        seen.wall_steps.add(d, wave_mm(d) + own + error(random));
      }
    }
  }
  return run;
}

std::function<double(double)> wave(double amplitude_mm, int per_period, double frequency_hz) {
  const double per_m = 4.0 * std::numbers::pi * per_period * frequency_hz / 299'792'458.0;
  return [=](double d) { return amplitude_mm * std::sin(per_m * d); };
}

/// A wave of 0.31 m, that whole images' means would lose.
TEST(RunTraits, OfTheStandardPlanTellThreeFrequencies) {
  const RunTraits all = traitsOf(wallsOfTheStandardPlan(wave(4.0, 4, 120e6)));
  for (const char* of : {"A", "B"}) {
    expectNear(find(all, "harmonics, against", of, "80 MHz, 6 per period = 120 MHz, 4 per period"), 4.0);
    expectNear(find(all, "harmonics, against", of, "80 MHz, 4 per period"), 0.0);
    EXPECT_NE(find(all, "harmonics, against", of, "16 MHz, 4 per period"), nullptr);
  }
}

/// A clipped sine of 16 MHz that is seen in three steps errs six times per period.
TEST(RunTraits, OfTheStandardPlanTellTheSixWavesOfThreeSteps) {
  const RunTraits all = traitsOf(wallsOfTheStandardPlan(wave(1.2, 6, 16e6)));
  expectNear(find(all, "harmonics, against", "A", "16 MHz, 6 per period"), 1.2);
  for (const char* none : {"16 MHz, 4 per period", "16 MHz, 3 per period"})
    expectNear(find(all, "harmonics, against", "A", none), 0.0);
}

/// The wall's rows reach 4 m · 2/√3 = 4.62 m of the 9.37 m of 16 MHz; of a wall at 10 m, 11.5 m.
TEST(RunTraits, SayWhichWavesTheDistancesAreTooShortFor) {
  const auto none = [](double) { return 0.0; };
  const auto isOfWaves = testing::Contains(
      testing::AllOf(testing::HasSubstr("harmonics, against the plan's wall of A: waves of"),
                     testing::HasSubstr("1 per period are not told"),
                     testing::HasSubstr("of the period of 16 MHz, 9.37 m; up to 9.97 m")));
  EXPECT_THAT(traitsOf(wallsOfTheStandardPlan(none)).untold, isOfWaves);
  const RunTraits longer =
      traitsOf(wallsOfTheStandardPlan(wave(2.0, 1, 16e6), {4.7, 5.5, 6.4, 7.4, 8.6, 10.0}));
  EXPECT_THAT(longer.untold, testing::Not(isOfWaves));
  expectNear(find(longer, "harmonics, against", "A", "16 MHz, 1 per period"), 2.0);
  expectNear(find(longer, "harmonics, against", "A", "16 MHz, 2 per period"), 0.0);
}

/// Over 4 m, those of 80 and 120 MHz are their own, and those of 16 MHz, of which 2 and 1 per period are not
/// told, may be others; over a whole period of 16 MHz, none may.
TEST(RunTraits, DoubtTheWavesThatMayBeOthersWhichAreNotTold) {
  const RunTraits all = traitsOf(wallsOfTheStandardPlan(wave(4.0, 4, 120e6)));
  const auto doubtOf = [](const RunTraits& of, const char* name) {
    const RunTrait* found = find(of, "harmonics, against", "A", name);
    return found == nullptr ? "it is not there" : found->trait.doubt;
  };
  EXPECT_EQ(doubtOf(all, "80 MHz, 6 per period = 120 MHz, 4 per period"), "");
  EXPECT_EQ(doubtOf(all, "80 MHz, 4 per period"), "");
  EXPECT_THAT(doubtOf(all, "16 MHz, 4 per period"),
              testing::HasSubstr("it may be a wave of 120 MHz, 1 per period"));
  EXPECT_THAT(doubtOf(all, "16 MHz, 3 per period"), testing::HasSubstr("these distances do not tell"));
  const RunTraits longer =
      traitsOf(wallsOfTheStandardPlan(wave(2.0, 1, 16e6), {4.7, 5.5, 6.4, 7.4, 8.6, 10.0}));
  for (const char* name : {"16 MHz, 4 per period", "16 MHz, 3 per period", "16 MHz, 1 per period"})
    EXPECT_EQ(doubtOf(longer, name), "");
}

}  // namespace
}  // namespace toftwin::plan
