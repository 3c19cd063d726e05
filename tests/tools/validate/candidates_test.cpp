// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/candidates.h"

#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tools/validate/free_numbers.h"
#include "tools/validate/walls.h"

namespace toftwin::validate {
namespace {

constexpr unsigned kWallSeed = 20261124;

class OfPreset : public testing::TestWithParam<const char*> {
 protected:
  const sim::SensorModel camera = sim::SensorModel::preset(GetParam()).value();
};
INSTANTIATE_TEST_SUITE_P(Walls, OfPreset, testing::Values("kinect_v2", "o3d303"));

/// 4.5 standard errors, all pixels of a frame counted as one since filters tie them together: a false alarm
/// in 1 of 25,000 runs of these six.
TEST_P(OfPreset, FrameWithoutNoiseIsTheMeanOfNoisyOnes) {
  constexpr int kFrames = 400;
  const auto walls = traceWalls(camera, 0.8, {800.0, 1500.0, 2500.0}, kWallSeed);
  ASSERT_TRUE(walls.ok());
  const std::vector<double> plain = readRanges(withoutNoise(camera), *walls);
  const std::vector<WallReading> noisy = readWalls(camera, *walls, kFrames, kWallSeed);
  for (std::size_t i = 0; i < plain.size(); ++i)
    EXPECT_NEAR(plain[i], noisy[i].range_mm, 4.5 * noisy[i].sigma_mm / std::sqrt(kFrames))
        << walls->truth_mm[i];
}

/// A camera that lacks the effects of the one that took the table gets them by the fit: what it leaves of
/// rows that it was not fitted to is their noise.
TEST_P(OfPreset, PlantedEffectsAreFittedThroughTheSimulator) {
  constexpr double kNoise_mm = 1.0;
  const sim::SensorModel preset = withoutNoise(camera);
  std::vector<sim::AnyEffect> effects = preset.effects();
  effects.push_back(sim::Delay{.offset = 12_mm});
  effects.push_back(sim::StepPhase{.step = 0, .error = 2_deg});
  effects.push_back(sim::StepPhase{.step = 1, .error = -2_deg});
  const sim::SensorModel truth = preset.withEffects(std::move(effects));
  std::vector<double> distances_mm;
  for (double d = 690.0; d < 2720.0; d += 15.0) distances_mm.push_back(d);
  const auto walls = traceWalls(preset, 0.8, distances_mm, kWallSeed);
  ASSERT_TRUE(walls.ok());
  std::mt19937 random(kWallSeed);
  std::uniform_real_distribution<double> anywhere(700.0, 2700.0);
  std::vector<double> reference_mm;
  for (int i = 0; i < 1000; ++i) reference_mm.push_back(anywhere(random));
  std::vector<double> error_mm = errorsAt(reference_mm, walls->truth_mm, readRanges(truth, *walls));
  std::normal_distribution<double> noise(0.0, kNoise_mm);
  for (double& one : error_mm) one += noise(random);

  const auto candidates = loadCandidates(std::filesystem::path{TOFTWIN_SOURCE_DIR} / "tools/validate/datasets/tof-thesis-2018" /
                                         ("candidates_" + std::string{GetParam()} + ".toml"));
  ASSERT_TRUE(candidates.ok()) << candidates.error().message;
  Judged judged;
  const auto simulate = [&](const sim::SensorModel& one) { return errorsAt(reference_mm, walls->truth_mm, readRanges(one, *walls)); };
  addCandidates("camera, distances", {reference_mm, error_mm, 100.0, preset, simulate}, *candidates, 3, judged);
  ASSERT_EQ(judged.outcomes.size(), 1u);
  const Outcome& outcome = judged.outcomes.front();
  EXPECT_GT(outcome.judged, 400u);
  // χ²: the standard error of a root mean square of n is σ/√2n; and a few numbers were fitted.
  EXPECT_NEAR(outcome.fitted_mm, kNoise_mm, 4.5 * kNoise_mm / std::sqrt(2.0 * 400.0));
  EXPECT_GT(outcome.constant_mm, 2.0 * kNoise_mm);
  ASSERT_FALSE(judged.ablations.empty());
  EXPECT_EQ(judged.ablations.front().cause, "step_phase");
  EXPECT_GT(judged.ablations.front().without, 2.0 * kNoise_mm);
}

TEST(ErrorsAt, AreLinearBetweenWallsAndNothingBeyondThem) {
  const std::vector<double> errors =
      errorsAt({900.0, 1000.0, 1250.0, 2500.0}, {1000.0, 2000.0}, {1004.0, 2008.0});
  EXPECT_TRUE(std::isnan(errors[0]));
  EXPECT_DOUBLE_EQ(errors[1], 4.0);
  EXPECT_DOUBLE_EQ(errors[2], 5.0);
  EXPECT_TRUE(std::isnan(errors[3]));
}

}  // namespace
}  // namespace toftwin::validate
