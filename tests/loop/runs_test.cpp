// SPDX-License-Identifier: Apache-2.0
// What changes only from run to run is judged by runs.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <random>

#include <fmt/format.h>

#include "calib/loop/answer.h"
#include "calib/loop/discover.h"

namespace toftwin::loop {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

/// `runs` of 60 rows, each with a plate of its own, and an offset that runs differ by.
Discovery ofRuns(int runs, std::uint64_t seed, const std::function<double(double plate_mm)>& error, double offsets_mm) {
  std::mt19937_64 random{seed};
  std::normal_distribution<double> normal;
  std::string csv = "reference_mm,measured_mm,run,plate_mm\n";
  for (int run = 0; run < runs; ++run) {
    const double plate_mm = std::uniform_real_distribution{300.0, 900.0}(random), offset_mm = offsets_mm * normal(random);
    for (int i = 0; i < 60; ++i) {
      const double reference_mm = std::uniform_real_distribution{800.0, 4000.0}(random);
      csv += fmt::format("{:.3f},{:.3f},run{},{:.2f}\n", reference_mm, reference_mm + error(plate_mm) + offset_mm + 2.0 * normal(random), run, plate_mm);
    }
  }
  auto discovery = discover(*table::parseReadings(csv, {}, "runs.csv"), {});
  EXPECT_TRUE(discovery.ok());
  return *std::move(discovery);
}
const Effect* effectOver(const Discovery& d, const std::string& covariate) {
  for (const Effect& effect : d.mean.effects)
    if (effect.shape.covariates.front() == covariate) return &effect;
  return nullptr;
}

TEST(Runs, WhatOnlyTheirOffsetsLookLikeIsNotFoundOverTheirPlate) {
  constexpr std::uint64_t kFirst = 300;
  int found_in = 0;
  for (std::uint64_t seed = kFirst; seed < kFirst + 16; ++seed)
    found_in += effectOver(ofRuns(6, seed, [](double) { return 0.0; }, 3.0), "plate_mm") ? 1 : 0;
  // At one in a hundred tables two of sixteen come once in a hundred times.
  EXPECT_LE(found_in, 1) << "seeds from " << kFirst;
}

TEST(Runs, OffsetsThatAreNotClearAreNoIndependentRowsEither) {
  constexpr std::uint64_t kFirst = 400;
  int found_in = 0;
  for (std::uint64_t seed = kFirst; seed < kFirst + 16; ++seed)
    found_in += effectOver(ofRuns(6, seed, [](double) { return 0.0; }, 0.5), "plate_mm") ? 1 : 0;
  EXPECT_LE(found_in, 1) << "seeds from " << kFirst;
}

TEST(Runs, WhatGoesWithTheirPlateIsFoundAndSaidToRestOnThem) {
  const Discovery d = ofRuns(12, 21, [](double plate_mm) { return 3e6 / (plate_mm * plate_mm); }, 0.5);
  const Effect* effect = effectOver(d, "plate_mm");
  ASSERT_NE(effect, nullptr);
  EXPECT_EQ(effect->rests_on, 10);  // two of the twelve are locked
  EXPECT_THAT(answerOf(d).cautions, Contains(HasSubstr("rests on 10 of them")));
}

TEST(Runs, OfManyTheirMeansAreSearchedAsRowsAre) {
  const Discovery d = ofRuns(60, 22, [](double plate_mm) { return 4.0 * std::sin(2.0 * M_PI * plate_mm / 170.0); }, 0.3);
  const Effect* effect = effectOver(d, "plate_mm");
  ASSERT_NE(effect, nullptr);
  EXPECT_TRUE(effect->shape.has("wave")) << effect->shape.name();
  EXPECT_EQ(effect->rests_on, 48);
}

/// The error of a coefficient is that of as many independent runs as there are.
TEST(Runs, TheErrorOfWhatRestsOnThemIsThatOfRuns) {
  const Discovery d = ofRuns(14, 23, [](double plate_mm) { return 0.05 * plate_mm; }, 1.0);
  const Effect* effect = effectOver(d, "plate_mm");
  ASSERT_NE(effect, nullptr);
  ASSERT_EQ(effect->shape.name(), "straight line");
  // 1.03 mm a run over √11 × 173 mm, the deviation of a uniform plate: 1.8e-3; of eleven runs it is known to a fourth.
  EXPECT_NEAR(std::sqrt(effect->covariance(0, 0)), 1.8e-3, 1.2e-3);
}

}  // namespace
}  // namespace toftwin::loop
