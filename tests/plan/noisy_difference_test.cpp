// SPDX-License-Identifier: Apache-2.0
// B − A over distance where a camera's noise is far larger than what is looked for.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "calib/plan/run_traits.h"

namespace toftwin::plan {
namespace {

constexpr double kModulated_hz = 20e6, kWave_m = 299'792'458.0 / 2.0 / kModulated_hz;
constexpr int kSeeds = 40;

/// What two cameras' means of six frames err by.
struct Noise {
  double a_mm, b_mm;
};

/// A wall that fills ±30° of an image at eleven distances, seen by two cameras, B of which errs by `error_mm`
/// of the range in metres; each capture by 0.3 mm of its own.
ComparedRun noisyRun(unsigned seed, const Noise& sigma, bool knows_wall,
                     const std::function<double(double)>& error_mm) {
  constexpr int kWidth = 48, kHeight = 36;
  std::mt19937_64 random{seed};
  std::normal_distribution<double> normal{0.0, 1.0};
  ComparedRun run;
  run.frequency_hz = {std::vector{kModulated_hz}, std::vector{kModulated_hz}};
  for (const double middle_m : {0.6, 0.8, 1.0, 1.3, 1.6, 2.0, 2.5, 3.1, 3.8, 4.5, 5.2}) {
    ComparedCapture& one = run.captures.emplace_back();
    one.pixels = 1, one.record.kind = "distance", one.record.number = run.captures.size();
    one.noise_a_mm = std::sqrt(6.0) * sigma.a_mm, one.noise_b_mm = std::sqrt(6.0) * sigma.b_mm;
    compare::PoseComparison& seen = one.thinned;
    const Image<float> valid{kWidth, kHeight, 1.0F};
    seen.valid_a = seen.valid_b = valid, seen.range_a_mm = seen.difference_mm = valid;
    Image<float> wall_m = valid;
    const double own_mm = 0.3 * normal(random);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double wall = middle_m * std::hypot(1.0, (x - 23.5) / 41.0, (y - 17.5) / 41.0);
        const double a_mm = sigma.a_mm * normal(random), b_mm = sigma.b_mm * normal(random);
        wall_m(x, y) = static_cast<float>(wall);
        seen.range_a_mm(x, y) = static_cast<float>(1e3 * wall + a_mm);
        seen.difference_mm(x, y) = static_cast<float>(error_mm(wall) + own_mm + b_mm - a_mm);
      }
    }
    if (knows_wall) one.wall_range_m = wall_m;
  }
  return run;
}

const compare::Trait* differenceIn(const RunTraits& all, std::string_view name) {
  for (const RunTrait& one : all.traits) {
    if (one.what == "harmonics" && one.of == "B − A" && one.trait.name == name) return &one.trait;
  }
  return nullptr;
}

/// In how many of kSeeds runs each interval holds what was planted.
int held(const char* name, double truth, const Noise& sigma, bool knows_wall,
         const std::function<double(double)>& error_mm) {
  int count = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const RunTraits all = traitsOf(noisyRun(seed, sigma, knows_wall, error_mm));
    const compare::Trait* found = differenceIn(all, name);
    count += found != nullptr && found->low <= truth && truth <= found->high;
  }
  return count;
}

/// 95 % of 40: 38. Fewer than 32 are 1.2e-4 by chance; in 14 counts, 1.7e-3.
constexpr int kFewest = 32;
constexpr Noise kNoisyA{61.0, 4.0}, kNoisyB{4.0, 61.0}, kBothNoisy{61.0, 50.0};

TEST(NoisyDifference, OfCamerasWithoutErrorsHasNoScaleAndNoWaves) {
  const auto none = [](double) { return 0.0; };
  for (const bool knows_wall : {true, false}) {
    for (const Noise& sigma : {kNoisyA, kNoisyB, kBothNoisy}) {
      EXPECT_GE(held("scale", 0.0, sigma, knows_wall, none), kFewest) << sigma.a_mm << ' ' << knows_wall;
      EXPECT_GE(held("20 MHz, 4 per period", 0.0, sigma, knows_wall, none), kFewest)
          << sigma.a_mm << ' ' << knows_wall;
    }
  }
}

TEST(NoisyDifference, HasTheScaleAndTheWaveThatWerePlantedInB) {
  const auto planted = [](double d) {
    return 3.0 * (d - 2.0) + 12.0 * std::cos(8.0 * std::numbers::pi * d / kWave_m + 1.0);
  };
  EXPECT_GE(held("scale", 3.0, kBothNoisy, true, planted), kFewest);
  EXPECT_GE(held("20 MHz, 4 per period", 12.0, kBothNoisy, true, planted), kFewest);
}

TEST(NoisyDifference, SaysAtHowManyCapturesNoPoseTellsTheWallsRange) {
  const auto none = [](double) { return 0.0; };
  ComparedRun run = noisyRun(1, kNoisyA, true, none);
  const auto isSaid = testing::Contains(testing::HasSubstr("how far the wall was at"));
  EXPECT_THAT(traitsOf(run).untold, testing::Not(isSaid));
  run.captures.front().wall_range_m = {};
  EXPECT_THAT(traitsOf(run).untold,
              testing::Contains(testing::HasSubstr("how far the wall was at 1 of 11 captures")));
}

/// A box 1 m before the wall is not the wall: what both read there is no error over the wall's range.
TEST(NoisyDifference, LeavesOutWhatStandsBeforeTheWall) {
  ComparedRun run = noisyRun(1, {1.0, 1.0}, true, [](double) { return 0.0; });
  for (ComparedCapture& one : run.captures) {
    for (int x = 0; x < 12; ++x) {
      for (int y = 0; y < 36; ++y)
        one.thinned.range_a_mm(x, y) -= 1000.0F, one.thinned.difference_mm(x, y) = 50.0F;
    }
  }
  const RunTraits all = traitsOf(run);
  ASSERT_NE(differenceIn(all, "20 MHz, 4 per period"), nullptr);
  // Rows err by 1.4 mm / √(pixels of a step, some tens) besides their capture's 0.3 mm; 50 mm would show.
  EXPECT_LT(differenceIn(all, "20 MHz, 4 per period")->value, 1.0);
  EXPECT_LT(differenceIn(all, "residual")->value, 1.0);
}

}  // namespace
}  // namespace toftwin::plan
