// SPDX-License-Identifier: Apache-2.0
// What a run's blocks say of drift, harmonics, noise and masks, planted in its captures.
#include "calib/plan/run_traits.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

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
  run.frequency_hz = {kFrequency_hz};
  for (int i = 0; i < 100; ++i) {
    const bool is_warming = i < 60;
    ComparedCapture one;
    one.pixels = 15;
    one.record.kind = is_warming ? "warm_up" : "distance";
    one.record.a.since_power_on_s = one.record.b.since_power_on_s = 60.0 * i;
    const double d_m = is_warming ? 1.5 : 0.5 + 0.1 * (i - 60);
    one.range_a_mm = 1000.0 * d_m + error(random);
    one.difference_mm = (is_warming ? -8.0 * (1.0 - std::exp(-60.0 * i / 600.0))
                                    : 5.0 * std::sin(8.0 * std::numbers::pi * d_m / kPeriod_m)) +
                        error(random);
    one.amplitude_a = 100.0 + 40.0 * i;
    one.noise_a_mm = 400.0 / one.amplitude_a * (1.0 + 0.2 * error(random));
    one.amplitude_b = std::nan("");
    one.noise_b_mm = 1.0;
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

TEST(RunTraits, SayWhatTheyCannotTellAndWhy) {
  ComparedRun run = plantedRun();
  run.captures.erase(run.captures.begin() + 5, run.captures.begin() + 60);
  run.captures.resize(10);
  const RunTraits all = traitsOf(run);
  EXPECT_EQ(find(all, "harmonics", "B − A", "30 MHz, 4 per period"), nullptr);
  EXPECT_THAT(all.untold,
              testing::Contains(testing::HasSubstr("5 captures over distance for 1 frequencies; 12 are")));
}

}  // namespace
}  // namespace toftwin::plan
