// SPDX-License-Identifier: Apache-2.0
// Noise through the whole sensor against the formulas.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/camera_testing.h"

namespace toftwin::sim {
namespace {

// σ_φ = √(2 (N_e + N_a) / N) / (m N_e). 100,000 pixels: a standard deviation is known to 0.22 %; 1
// % is 4.5 of that.
TEST(ShotNoise, GivesThePhaseNoiseOfTheFormula) {
  const struct {
    int steps;
    double ambient, sigma_rad;
  } table[] = {{4, 0.0, 0.009428}, {4, 3.0, 0.018856}, {3, 0.0, 0.010887}, {5, 0.0, 0.008433}};
  for (const auto& row : table) {
    const SensorModel model = modelOf(plainCamera(row.steps, 2, 0.75, kShotNoise));
    const auto exposed = model.expose(evenLight(model, 1.0, 0.9, row.ambient), {}, 1, 0);
    const double sigma = rangeStatistics(exposed.range).sigma * kSigmaToPhase80MHz;
    EXPECT_NEAR(sigma, std::sqrt(2.0 * (1e4 + 1e4 * row.ambient) / row.steps) / (0.75 * 1e4),
                0.01 * sigma);
    EXPECT_NEAR(sigma, row.sigma_rad, 0.01 * row.sigma_rad)
        << row.steps << " steps, ambient " << row.ambient;
  }
}

// Read noise of σ in each of two taps adds 2 σ² to the variance of a difference.
TEST(ReadNoise, AddsToThePhaseNoiseAsTheFormulaSays) {
  const SensorModel model = modelOf(plainCamera(
      4, 2, 0.75,
      std::string{kShotNoise} + "[[effect]]\ntype = 'read_noise'\nsigma_electrons = 80\n"));
  const double sigma =
      rangeStatistics(model.expose(evenLight(model, 1.0, 0.9), {}, 2, 0).range).sigma *
      kSigmaToPhase80MHz;
  const double expected = std::sqrt(2.0 * (1e4 + 2.0 * 80.0 * 80.0) / 4.0) / (0.75 * 1e4);
  EXPECT_NEAR(sigma, expected, 0.01 * expected);
}

// Three single-ended samples: σ swings by ±10 % three times per turn, for var Sₖ = B + A cos(φ −
// θₖ). From the propagated variance (2/N)² Σ var Sₖ sin²(φ − θₖ) / A² = (2/N)(B − A cos 3φ / 2) /
// A²; at the contrast of 0.4 ±10 %.
TEST(ShotNoise, OfThreeSingleEndedSamplesSwingsThreeTimesPerTurn) {
  const double contrast = 0.4;
  const SensorModel model = modelOf(plainCamera(3, 1, contrast, kShotNoise));
  const double mean = 0.5e4, amplitude = contrast * mean;
  for (double phase : {0.0, kPi / 6.0, kPi / 3.0, 2.0 * kPi / 3.0, 1.3}) {
    const double range_m = (phase + 2.0 * kPi) / kSigmaToPhase80MHz;
    const double sigma =
        rangeStatistics(model.expose(evenLight(model, 1.0, range_m), {}, 3, 0).range).sigma;
    if (phase == 0.0) continue;  // wraps at range 0
    const double expected =
        std::sqrt(2.0 / 3.0 * (mean - amplitude * std::cos(3.0 * phase) / 2.0)) / amplitude;
    EXPECT_NEAR(sigma * kSigmaToPhase80MHz, expected, 0.01 * expected) << phase;
  }
}

TEST(Noise, IsKeyedByFrameSeedAndPixelAndNotByThreadsOrRegion) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.75, kShotNoise));
  const Light light = evenLight(model, 1.0, 0.9);
  const auto first = model.expose(light, {}, 1, 5).range;
  EXPECT_EQ(model.expose(light, {}, 1, 5).range.phasors, first.phasors);
  EXPECT_NE(model.expose(light, {}, 1, 6).range.phasors, first.phasors);
  EXPECT_NE(model.expose(light, {}, 2, 5).range.phasors, first.phasors);
  const Light part = syntheticLight(50, 20, {80_MHz}, 1, [](int, int) {
    return std::vector<Way>{{1.0, 0.9}};
  });
  const auto region = model.expose(part, {}, 1, 5, 37, 91).range;
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 50; ++x)
      ASSERT_EQ(region.range_m(x, y), first.range_m(37 + x, 91 + y)) << x << ", " << y;
  }
}

TEST(Noise, OfTwoFramesIsIndependentAtEveryPixel) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.75, kShotNoise));
  const Light light = evenLight(model, 1.0, 0.9);
  const auto a = model.expose(light, {}, 1, 0).range.range_m,
             b = model.expose(light, {}, 1, 1).range.range_m;
  double product = 0.0, square = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    product += (static_cast<double>(a[i]) - 0.9) * (static_cast<double>(b[i]) - 0.9);
    square += std::pow(static_cast<double>(a[i]) - 0.9, 2);
  }
  EXPECT_LT(std::abs(product / square), 5.0 / std::sqrt(100'000.0));  // 6e-7 false alarms
}

}  // namespace
}  // namespace toftwin::sim
