// SPDX-License-Identifier: Apache-2.0
// What a run's blocks say of drift, harmonics, noise, light and masks, planted in its captures.
#include "calib/plan/run_traits.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "calib/compare/trait_verdict.h"
#include "planted_runs.h"

namespace toftwin::plan {
namespace {

TEST(RunTraits, FindWhatWasPlanted) {
  const RunTraits all = traitsOf(plantedRun());
  RecordProperty("seed", kSeed);
  ASSERT_NE(find(all, "drift", "B", "time constant"), nullptr);
  EXPECT_EQ(find(all, "drift", "B", "time constant")->detail, "one exponential");
  expectNear(find(all, "drift", "B", "time constant"), 600.0);
  expectNear(find(all, "drift", "B", "drift"),
             -8.0 * (1.0 - std::exp(-59.0 * 60.0 / 600.0)));
  EXPECT_EQ(find(all, "drift", "A", "drift")->detail, "none");
  expectNear(find(all, "drift", "A", "drift"), 0.0);
  expectNear(find(all, "harmonics", "B − A", "30 MHz, 4 per period"), 5.0);
  expectNear(find(all, "masks", "A and B", "agreement"), 15.0 / 16.0);
}

/// Of 16 pixels B lacks one or two by turns and has another that A lacks: 1/32 fewer on the mean of 40
/// conditions. 60 repeats of one, in which it lacks all, are one row; and what is read in the dark is none.
TEST(RunTraits, TellWhichPixelsOneCameraLacks) {
  ComparedRun run = plantedRun();
  for (ComparedCapture& one : run.captures) {
    one.record.block = one.record.kind;
    if (one.record.kind == "distance") one.record.condition = one.record.number;
    one.thinned.valid_a[5] = 0.0F, one.thinned.valid_b[1] = one.record.number % 2 == 0 ? 0.0F : 1.0F;
    if (one.record.kind == "warm_up") one.thinned.valid_b = Image<float>(4, 4, 0.0F), one.pixels = 0;
  }
  ComparedCapture dark = run.captures.back();
  dark.record.kind = dark.record.block = "dark", dark.thinned.valid_b = Image<float>(4, 4, 0.0F);
  run.captures.push_back(dark);
  const RunTraits all = traitsOf(run);
  const double rows = 41.0;
  const RunTrait* less = find(all, compare::kValidPixels, "B − A", "share");
  ASSERT_NE(less, nullptr);
  EXPECT_EQ(less->trait.n, 41u);
  EXPECT_NEAR(less->trait.value, (40.0 * -0.5 / 16.0 - 15.0 / 16.0) / rows, 1e-12);
  EXPECT_NEAR(find(all, compare::kValidPixels, "A", "share")->trait.value, 15.0 / 16.0, 1e-12);
  EXPECT_NEAR(find(all, compare::kValidPixels, "A and B", "of A alone")->trait.value,
              (40.0 * 1.5 / 16.0 + 15.0 / 16.0) / rows, 1e-12);
  EXPECT_NEAR(find(all, compare::kValidPixels, "A and B", "of B alone")->trait.value, 40.0 / 16.0 / rows,
              1e-12);
  const RunTrait* lacked = find(all, compare::kValidPixels, "A and B", compare::kLackedByB);
  ASSERT_NE(lacked, nullptr);
  EXPECT_NEAR(lacked->trait.value, (40.0 * 1.5 + 15.0) / (15.0 * rows), 1e-12);
}

/// Of 16 pixels the same one, in all of a hundred captures: it is known to half a pixel of one image, not of
/// a hundred.
TEST(RunTraits, KnowMissingPixelsToHalfAPixelOfAnImage) {
  ComparedRun run = plantedRun();
  for (ComparedCapture& one : run.captures) one.record.condition = one.record.number;
  const RunTraits all = traitsOf(run);
  const RunTrait* less = find(all, compare::kValidPixels, "B − A", "share");
  ASSERT_NE(less, nullptr);
  EXPECT_EQ(less->trait.n, 100u);
  EXPECT_NEAR(less->trait.value, -1.0 / 16.0, 1e-12);
  EXPECT_NEAR(less->trait.low, -1.5 / 16.0, 1e-12);
  EXPECT_NEAR(less->trait.high, -0.5 / 16.0, 1e-12);
}

/// σ² = 1² + 2² d² and a pattern of 0.5 mm at all distances; amplitude falls with d². B has half of it.
TEST(RunTraits, TellNoiseAndPatternOverDistanceAndAmplitude) {
  std::mt19937_64 random{kSeed};
  std::normal_distribution<double> error{0.0, 0.02};
  ComparedRun run = plantedRun();
  for (ComparedCapture& one : run.captures) {
    one.record.distance_m = 1e-3 * one.range_a_mm;
    const double d = one.record.distance_m, sigma = std::sqrt(1.0 + 4.0 * d * d);
    for (const std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
      const double share = camera == 0 ? 1.0 : 0.5;
      one.seen[camera].noise = {{"temporal noise", "mm", share * sigma * (1.0 + error(random))},
                                {"fixed pattern", "mm", share * 0.5 * (1.0 + error(random)), 0.1}};
      one.seen[camera].brightness = {1000.0 / (d * d)};
    }
  }
  run.captures.back().seen[0].noise[1] = {"fixed pattern", "mm", 9.0, 0.0};  // too weak to be told: no row
  const RunTraits all = traitsOf(run);
  const double nearest = 0.5;
  for (const auto& [of, share] : {std::pair{"A", 1.0}, {"B", 0.5}}) {
    expectNear(find(all, kNoiseOverDistance, of, "floor"), share * 1.0);
    expectNear(find(all, kNoiseOverDistance, of, "shot"), share * 2.0 * nearest);
    expectNear(find(all, kPatternOverDistance, of, "constant part"), share * 0.5);
    expectNear(find(all, kPatternOverAmplitude, of, "constant part"), share * 0.5);
  }
  const auto rows = std::ranges::find(all.rows, kPatternOverDistance, &compare::NamedRows::what);
  ASSERT_NE(rows, all.rows.end());
  EXPECT_EQ(rows->x.size(), 39u);
  EXPECT_NEAR(rows->curve.at(2.0), 0.5, 0.02);
}

/// σ = 20 m / amplitude, amplitudes from 100 on in steps of 40: 0.1 rad of 30 MHz, 79.5 mm, at 251.
TEST(RunTraits, SayUpToWhichNoiseTheLawHolds) {
  ComparedRun run = plantedRun();
  for (ComparedCapture& one : run.captures) {
    const double light = 1e-4 * one.amplitude_a;
    one.own[0].noise_mm = 2.0 / light, one.record.distance_m = std::sqrt(1.0 / light);
    one.seen[0].noise = {{"temporal noise", "mm", one.own[0].noise_mm},
                         {"fixed pattern", "mm", one.own[0].noise_mm, 1.0}};
    one.seen[0].brightness = {one.amplitude_a};
  }
  for (ComparedCapture& one : run.captures) one.record.kind = "distance";
  const auto says = [&](const char* words) { return testing::Contains(testing::HasSubstr(words)); };
  const auto untold = traitsOf(run).untold;
  EXPECT_THAT(untold,
              says("noise law of A: 4 of 100 rows are left out, of signals up to 0.054 of the largest"));
  EXPECT_THAT(untold, says("temporal noise over distance of A: 4 of 100 rows are left out"));
  EXPECT_THAT(untold, testing::Not(says("fixed pattern over distance of A: 4")));
  EXPECT_THAT(untold, testing::Not(says("fixed pattern over amplitude of A: 4")));
  EXPECT_THAT(untold, testing::Not(says("up to which noise the noise law of A holds")));
  run.frequency_hz[0].clear();
  EXPECT_THAT(traitsOf(run).untold, says("up to which noise the noise law of A holds: its frames say no"));
}

/// Without a frequency nothing else would leave it out: a signal of 1/4000 of the largest, with 1.5 m of
/// noise.
TEST(RunTraits, TakeNoNoiseLawOfACoveredLens) {
  ComparedRun run = plantedRun();
  run.frequency_hz[0].clear();
  const auto noiseOf = [](const ComparedRun& of) {
    const RunTraits all = traitsOf(of);
    return std::ranges::find(all.rows, kNoiseLaw, &compare::NamedRows::what)->y;
  };
  const auto without = noiseOf(run);
  ComparedCapture& dark = run.captures.emplace_back();
  dark.record.kind = "dark", dark.own[0].amplitude = 1.0, dark.own[0].noise_mm = 1500.0;
  EXPECT_EQ(noiseOf(run), without);
  run.captures.back().record.kind = "distance";
  EXPECT_NE(noiseOf(run), without);
}

/// B is 30 mm off at 2.2 m, where there is a fifth of the light, and not at 1 m; and 2 mm farther per decade
/// at both. With one constant for both, the distance would be −40 mm per decade.
TEST(RunTraits, TakeADistanceForNoAmplitude) {
  std::mt19937_64 random{kSeed};
  std::normal_distribution<double> error{0.0, 0.05};
  ComparedRun run;
  for (const double exposure : {0.25, 0.5, 0.75, 1.25, 1.5}) {
    for (const double d_m : {1.0, 2.2}) {
      ComparedCapture& one = run.captures.emplace_back();
      one.pixels = 1, one.record.kind = "exposure", one.record.distance_m = d_m;
      one.amplitude_a = 1000.0 * exposure / (d_m * d_m), one.own[1].amplitude = 0.5 * one.amplitude_a;
      one.difference_mm = 2.0 * std::log10(one.amplitude_a) + (d_m > 2.0 ? 30.0 : 0.0) + error(random);
      one.seen[1].wall_error_mm = {one.difference_mm};
    }
  }
  const RunTraits all = traitsOf(run);
  expectNear(find(all, "error over amplitude", "B − A", "per decade"), 2.0);
  expectNear(find(all, "error over amplitude, against", "B", "per decade"), 2.0);
  EXPECT_EQ(find(all, "error over amplitude", "B − A", "at 1"), nullptr);
}

/// A wall from 1 m in the middle to 1.6 m at the corner, in light of 0 to 35 klx that adds 4 mm² of noise²
/// for each and no bias; the camera loses one pixel more for each 5 klx, the farthest first.
OwnReading inLight(double klx, double noise_mm2_per_klx, int lost, std::mt19937_64& random) {
  std::normal_distribution<double> error{0.0, 0.05};
  OwnReading own{.range_mm = Image<float>(8, 8), .noise_each_mm = Image<float>(8, 8)};
  for (std::size_t i = 0; i < 64; ++i) {
    const double at_mm = 1000.0 + 600.0 * static_cast<double>(i) / 63.0;
    const bool is_lost = static_cast<int>(i) >= 64 - lost;
    own.range_mm[i] = is_lost ? std::nanf("") : static_cast<float>(at_mm + error(random));
    own.noise_each_mm[i] = static_cast<float>(at_mm / 1300.0 * std::sqrt(1.0 + noise_mm2_per_klx * klx));
  }
  return own;
}

TEST(RunTraits, OfACameraInLightAreTheSameBesideAnyOther) {
  std::vector<std::vector<RunTrait>> of_a;
  for (const int b_loses : {0, 4}) {
    std::mt19937_64 random{kSeed}, others{kSeed + 1};
    ComparedRun run;
    for (int i = 0; i < 24; ++i) {
      ComparedCapture& one = run.captures.emplace_back();
      const int step = i % 8;
      one.record.kind = "ambient", one.record.ambient_klx = 5.0 * step;
      one.own = {inLight(one.record.ambient_klx, 4.0, step, random),
                 inLight(one.record.ambient_klx, 4.0, b_loses * step, others)};
      // What both have: B's mask moves A's mean.
      one.pixels = 64 - static_cast<std::size_t>(b_loses * step);
      one.range_a_mm = 1300.0 - 600.0 / 126.0 * b_loses * step, one.noise_a_mm = 1e-3 * one.range_a_mm;
    }
    const RunTraits all = traitsOf(run);
    expectNear(find(all, "ambient light", "A", "bias"), 0.0);
    expectNear(find(all, "ambient light", "B", "bias"), 0.0);
    // Of pixels 0 to 56 the one in the middle is at 1266.7 mm, and its noise is as much less.
    EXPECT_NEAR(find(all, "ambient light", "A", "noise²")->trait.value, 4.0 * std::pow(1266.667 / 1300.0, 2),
                1e-5);
    auto& numbers = of_a.emplace_back();
    std::ranges::copy_if(all.traits, std::back_inserter(numbers),
                         [](const auto& one) { return one.of == "A"; });
  }
  ASSERT_EQ(of_a[0].size(), of_a[1].size());
  for (std::size_t i = 0; i < of_a[0].size(); ++i) {
    EXPECT_EQ(of_a[0][i].trait.value, of_a[1][i].trait.value) << of_a[0][i].trait.name;
    EXPECT_EQ(of_a[0][i].trait.high, of_a[1][i].trait.high) << of_a[0][i].trait.name;
  }
}

/// A has no pixel from 5 klx on: B has a number that A has not, and why is said beside it.
TEST(RunTraits, SayFromWhichLightOnACameraIsBlind) {
  std::mt19937_64 random{kSeed};
  ComparedRun run;
  for (int i = 0; i < 24; ++i) {
    ComparedCapture& one = run.captures.emplace_back();
    one.record.kind = "ambient", one.record.ambient_klx = 5.0 * (i % 8), one.pixels = 64;
    one.own = {inLight(one.record.ambient_klx, 4.0, i % 8 == 0 ? 0 : 64, random),
               inLight(one.record.ambient_klx, 4.0, 0, random)};
  }
  for (const auto& one : compare::verdictsOf(traitsOf(run))) {
    if (one.what == "ambient light") {
      EXPECT_EQ(one.why_not,
                "A has none: at 5 to 35 klx, in 21 of 24 captures, it lost over half of its pixels");
    }
  }
  EXPECT_THAT(traitsOf(run).untold, testing::Contains(testing::StartsWith("ambient light of A: at 5 to 35 klx")));
}

TEST(RunTraits, SayWhatTheyCannotTellAndWhy) {
  ComparedRun run = plantedRun();
  run.captures.erase(run.captures.begin() + 5, run.captures.begin() + 60);
  run.captures.resize(10);
  const RunTraits all = traitsOf(run);
  EXPECT_EQ(find(all, "harmonics", "B − A", "30 MHz, 4 per period"), nullptr);
  EXPECT_THAT(all.untold, testing::Contains(testing::HasSubstr(
                              "harmonics of B − A: harmonics: 5 of 5 rows are finite, and it takes 12")));
}

/// A tells its noise, 10 mm per metre, from 0.5 to 4.4 m; B has enough of the wall up to 1.4 m only.
TEST(RunTraits, TellNoiseOfFramesAtOneCaptureForBoth) {
  ComparedRun run = plantedRun();
  const auto noiseAt = [](double d) { return std::vector{compare::Trait{"temporal noise", "mm", 10.0 * d}}; };
  for (ComparedCapture& one : run.captures) {
    if (one.record.kind != "distance") continue;
    one.record.distance_m = 0.5 + 0.1 * static_cast<double>(one.record.number - 60);
    one.seen[0].noise = noiseAt(one.record.distance_m);
    if (one.record.number < 70) one.seen[1].noise = noiseAt(one.record.distance_m);
  }
  const RunTraits all = traitsOf(run);
  const auto *a = find(all, "noise of frames", "A", "temporal noise"),
             *b = find(all, "noise of frames", "B", "temporal noise");
  ASSERT_TRUE(a != nullptr && b != nullptr);
  EXPECT_EQ(a->trait.value, b->trait.value);
  EXPECT_EQ(a->detail, b->detail);
  // None in common: of neither.
  for (ComparedCapture& one : run.captures) {
    if (one.record.number < 70) one.seen[0].noise.clear();
  }
  const RunTraits apart = traitsOf(run);
  EXPECT_EQ(find(apart, "noise of frames", "A", "temporal noise"), nullptr);
  EXPECT_THAT(
      apart.untold,
      testing::Contains(testing::HasSubstr("noise of frames of B: A and B tell it at no capture in common")));
}

}  // namespace
}  // namespace toftwin::plan
