// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/fits.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace toftwin::compare {
namespace {

TEST(Solve3, GivesTheSolutionOfAPermutedSystem) {
  // Needs pivoting: the first diagonal element is zero.
  const auto x = solve3({{{0, 2, 0}, {1, 0, 0}, {0, 1, 4}}}, {6, 5, 11});
  EXPECT_DOUBLE_EQ(x[0], 5.0);
  EXPECT_DOUBLE_EQ(x[1], 3.0);
  EXPECT_DOUBLE_EQ(x[2], 2.0);
}

TEST(NoiseLaw, IsRecoveredExactlyFromItself) {
  const NoiseLaw law{.a_mm = 1.5, .b = 40.0, .c = 2000.0};
  std::vector<double> intensity, sigma;
  for (double i = 100.0; i < 20'000.0; i *= 1.1)
    intensity.push_back(i), sigma.push_back(law.sigma_mm(i));
  const NoiseLaw fit = fitNoiseLaw(intensity, sigma);
  EXPECT_NEAR(fit.a_mm, 1.5, 1e-4);
  EXPECT_NEAR(fit.b, 40.0, 4e-3);
  EXPECT_NEAR(fit.c, 2000.0, 0.2);
  EXPECT_LT(fit.rms_log, 1e-5);
}

TEST(NoiseLaw, DoesNotInventAPartThatIsNotThere) {
  std::vector<double> intensity, sigma;  // pure shot noise
  for (double i = 100.0; i < 20'000.0; i *= 1.1)
    intensity.push_back(i), sigma.push_back(40.0 / std::sqrt(i));
  const NoiseLaw fit = fitNoiseLaw(intensity, sigma);
  EXPECT_NEAR(fit.b, 40.0, 0.1);
  EXPECT_LT(fit.a_mm, 0.03);      // the shot part is 0.28 there at least
  EXPECT_LT(fit.c / 100.0, 0.4);  // 4.0 of shot noise at 100 counts
}

TEST(WarmUp, FindsTheEffectItWasMadeWith) {
  const sim::WarmUp effect{.fast = 3_mm, .fast_time = 60_s, .slow = 6_mm, .slow_time = 600_s};
  std::vector<double> time, depth;
  for (double t = 1.0; t < 1200.0; t += 2.0)
    time.push_back(t), depth.push_back(900.0 + effect.drift(t * second).in(millimetre));
  const WarmUpFit fit = fitWarmUp(time, depth, 2);
  // The grid of time constants has steps of 15 %; between them 2 % of the smaller amplitude can
  // remain.
  EXPECT_LT(fit.rms_mm, 0.06);
  for (const double t : {5.0, 100.0, 700.0})
    EXPECT_NEAR(fit.depth_mm(t), 900.0 + effect.drift(t * second).in(millimetre), 0.2);
}

TEST(WarmUp, WithoutExponentialsIsTheMean) {
  const WarmUpFit fit = fitWarmUp(std::vector<double>{1, 2, 3}, std::vector<double>{10, 20, 30}, 0);
  EXPECT_NEAR(fit.depth_mm(7.0), 20.0, 1e-12);
  EXPECT_NEAR(fit.rms_mm, std::sqrt(200.0 / 3.0), 1e-12);
}

}  // namespace
}  // namespace toftwin::compare
