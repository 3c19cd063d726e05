// SPDX-License-Identifier: Apache-2.0
// What a run's blocks say of drift, harmonics, noise and masks, planted in its captures.
#include "calib/plan/run_traits.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "calib/compare/trait_verdict.h"
#include "calib/compare/verdict_words.h"
#include "calib/plan/seen_plate.h"
#include "plans.h"

namespace toftwin::plan {
namespace {

constexpr double kFrequency_hz = 30e6, kPeriod_m = 299'792'458.0 / 2.0 / kFrequency_hz;
constexpr unsigned kSeed = 20261122;

/// 60 captures while B warms up (−8 mm, τ = 600 s) and A does not, 40 over distance with a wave of 5 mm four
/// times per period; noise 400 mm / amplitude; pixel 0 is invalid in B alone.
ComparedRun plantedRun() {
  std::mt19937_64 random{kSeed};
  std::normal_distribution<double> error{0.0, 0.1};
  ComparedRun run;
  run.frequency_hz = {std::vector{kFrequency_hz}, std::vector{kFrequency_hz}};
  for (int i = 0; i < 100; ++i) {
    const bool is_warming = i < 60;
    ComparedCapture one;
    one.pixels = 15;
    one.record.number = static_cast<std::size_t>(i);
    one.record.kind = is_warming ? "warm_up" : "distance";
    one.record.a.since_power_on_s = one.record.b.since_power_on_s = 60.0 * i;
    const double d_m = is_warming ? 1.5 : 0.5 + 0.1 * (i - 60);
    one.range_a_mm = 1000.0 * d_m + error(random);
    one.difference_mm = (is_warming ? -8.0 * (1.0 - std::exp(-60.0 * i / 600.0))
                                    : 5.0 * std::sin(8.0 * std::numbers::pi * d_m / kPeriod_m)) +
                        error(random);
    one.amplitude_a = 100.0 + 40.0 * i;
    one.noise_a_mm = 400.0 / one.amplitude_a * (1.0 + 0.2 * error(random));
    one.own[0].amplitude = one.amplitude_a, one.own[0].noise_mm = one.noise_a_mm;
    one.own[1].amplitude = std::nan("");
    one.own[0].range_mm = Image<float>(4, 4, static_cast<float>(one.range_a_mm));
    one.own[1].range_mm = Image<float>(4, 4, static_cast<float>(one.range_a_mm + one.difference_mm));
    one.thinned.valid_a = Image<float>(4, 4, 1.0F);
    one.thinned.valid_b = Image<float>(4, 4, 1.0F);
    one.thinned.valid_b[0] = 0.0F;
    run.captures.push_back(one);
  }
  return run;
}

const RunTrait* find(const RunTraits& all, std::string_view what, std::string_view of,
                     std::string_view name) {
  for (const RunTrait& one : all.traits) {
    if (one.what.starts_with(what) && one.of == of && one.trait.name == name) return &one;
  }
  return nullptr;
}

/// Within twice its interval's half: 3.9 standard errors, a false alarm of 1e-4 for each.
void expectNear(const RunTrait* found, double truth) {
  ASSERT_NE(found, nullptr);
  EXPECT_NEAR(found->trait.value, truth, found->trait.high - found->trait.low)
      << found->what << ' ' << found->trait.name;
}

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

/// Cells of a wall, a row each 25 mm of range: an error of 5 sin d besides `veil` times what a veil of 1
/// does, w_f · v_f summed over the frequencies, w_f = f / Σ f of a Kinect v2.
CameraSeen wallWith(double veil, double from_m, const std::function<double(double, double)>& slope_mm) {
  const std::array frequency_mhz{16.0, 80.0, 120.0};
  CameraSeen seen;
  seen.wall_veil_mm.resize(frequency_mhz.size());
  for (int i = 0; i < 40; ++i) {
    const double d = from_m + 0.025 * i;
    double moved_mm = 0.0;
    for (std::size_t f = 0; f < frequency_mhz.size(); ++f) {
      seen.wall_veil_mm[f].push_back(slope_mm(frequency_mhz[f], d));
      moved_mm += frequency_mhz[f] / 216.0 * seen.wall_veil_mm[f].back();
    }
    seen.wall_range_m.push_back(d), seen.wall_error_mm.push_back(5.0 * std::sin(d) + veil * moved_mm);
  }
  return seen;
}

void addCapture(ComparedRun& run, const char* kind, const CameraSeen& seen, const char* pose_by = "command") {
  ComparedCapture& one = run.captures.emplace_back();
  one.record.number = run.captures.size(), one.record.kind = kind, one.record.pose_by = pose_by;
  one.seen = {seen, seen};
}

/// What a wall by itself shows, its own error and its own light's veil, and a plate before it in three
/// captures.
ComparedRun veiledRun(double veil, const char* plates) {
  const auto of_wall = [](double mhz, double d) { return 40.0 * std::cos(0.02 * mhz * d); };
  ComparedRun run;
  run.frequency_hz = {std::vector{16e6, 80e6, 120e6}, std::vector{16e6, 80e6, 120e6}};
  addCapture(run, "distance", wallWith(veil, 1.0, of_wall)),
      addCapture(run, "distance", wallWith(veil, 2.0, of_wall));
  for (const double plate_m : {0.6, 0.8, 1.1}) {
    addCapture(run, plates, wallWith(veil, 1.5, [&](double mhz, double d) {
                 return of_wall(mhz, d) + 300.0 * std::sin(0.04 * mhz * (d - plate_m));
               }));
  }
  return run;
}

/// Rows are exact, so the share is, too: to rounding in 120 rows of some 100 mm.
constexpr double kRounding = 1e-9;

TEST(RunTraits, TellLensScatterOfAPlateBesideTheWallAlone) {
  for (const char* kind : {"scatter", "foreground"}) {
    const RunTraits all = traitsOf(veiledRun(0.03, kind));
    for (const char* of : {"A", "B"}) {
      const RunTrait* veil = find(all, "lens scatter", of, "veil");
      ASSERT_NE(veil, nullptr) << kind;
      EXPECT_NEAR(veil->trait.value, 0.03, kRounding) << kind;
    }
  }
}

TEST(RunTraits, TakeLensScatterOfTheBlocksThatAreMadeForIt) {
  ComparedRun run = veiledRun(0.03, "scatter");
  const ComparedRun other = veiledRun(0.5, "foreground");
  run.captures.insert(run.captures.end(), other.captures.begin() + 2, other.captures.end());
  EXPECT_NEAR(find(traitsOf(run), "lens scatter", "A", "veil")->trait.value, 0.03, kRounding);
}

TEST(RunTraits, TakeNoLensScatterWhereThePoseIsFittedToThePlanes) {
  ComparedRun run = veiledRun(0.03, "scatter");
  addCapture(run, "scatter",
             wallWith(0.5, 1.5, [](double mhz, double d) { return 300.0 * std::sin(0.01 * mhz * d); }),
             "planes");
  EXPECT_NEAR(find(traitsOf(run), "lens scatter", "A", "veil")->trait.value, 0.03, kRounding);
}

/// A cell of the wall alone without an amplitude says nothing of a veil, so its error is not what the others'
/// is less.
TEST(RunTraits, TakeErrorAndVeilOfTheWallAloneOfTheSameCells) {
  ComparedRun run = veiledRun(0.03, "scatter");
  CameraSeen dim = wallWith(0.03, 1.5, [](double, double) { return std::nan(""); });
  for (double& error : dim.wall_error_mm) error = 40.0;
  addCapture(run, "distance", dim);
  EXPECT_NEAR(find(traitsOf(run), "lens scatter", "A", "veil")->trait.value, 0.03, kRounding);
}

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

TEST(RunTraits, SayThatNoFrameShowsAPlateMove) {
  ComparedRun run = plantedRun();
  run.moving.emplace_back().record.kind = "moving";
  EXPECT_THAT(traitsOf(run).untold, testing::Contains(testing::HasSubstr("motion of A: in none of 1 captures")));
}

/// A plate of 8 × 8 pixels one metre before a wall at 2 m goes one pixel, 1/20 of its metre, per frame of 0.1 s.
TEST(MovingPlate, IsTimedByItsExposuresWhereAllFramesHaveOneTimeSincePowerOn) {
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
  EXPECT_EQ(simulated.plate_time_s, (std::vector{600.0, 600.05, 600.1}));
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
              testing::Contains(testing::HasSubstr("errors against the plan's walls at 1 captures")));
}

}  // namespace
}  // namespace toftwin::plan
