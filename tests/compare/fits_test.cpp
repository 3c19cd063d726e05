// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/fits.h"

#include <cmath>
#include <numbers>
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

TEST(Minimum1d, FindsTheLowestOfTwoValleys) {
  const auto f = [](double x) { return std::cos(3.0 * x) + 0.1 * x; };
  EXPECT_NEAR(minimum1d(f, 0.0, 4.0), std::numbers::pi / 3.0 - std::asin(0.1 / 3.0) / 3.0, 1e-4);
}

}  // namespace
}  // namespace toftwin::compare
