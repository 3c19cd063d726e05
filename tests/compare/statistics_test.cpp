// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/statistics.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace toftwin::compare {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(Summary, OfFourNumbersIsWhatPaperGives) {
  // mean 2.5, Σ(v − 2.5)² = 5, so sd = √(5/3); mean square = 30/4.
  const std::vector<double> values{4, 1, 3, 2};
  const Summary s = summarise(values);
  EXPECT_EQ(s.n, 4U);
  EXPECT_DOUBLE_EQ(s.mean, 2.5);
  EXPECT_DOUBLE_EQ(s.sd, std::sqrt(5.0 / 3.0));
  EXPECT_DOUBLE_EQ(s.standard_error, std::sqrt(5.0 / 3.0) / 2.0);
  EXPECT_DOUBLE_EQ(s.rms, std::sqrt(7.5));
  EXPECT_DOUBLE_EQ(s.median, 2.5);
  EXPECT_DOUBLE_EQ(s.p95_abs, 3.85);  // place 0.95 × 3 = 2.85 between 3 and 4
  EXPECT_EQ(s.min, 1.0);
  EXPECT_EQ(s.max, 4.0);
}

TEST(Summary, LeavesInvalidPixelsOutAndDoesNotCountThem) {
  const std::vector<double> values{1, kNaN, 3};
  const Summary s = summarise(values);
  EXPECT_EQ(s.n, 2U);
  EXPECT_DOUBLE_EQ(s.mean, 2.0);
}

TEST(Summary, OfNothingIsNotANumberRatherThanZero) {
  const Summary s = summarise(std::vector<double>{kNaN});
  EXPECT_EQ(s.n, 0U);
  EXPECT_TRUE(std::isnan(s.mean) && std::isnan(s.rms) && std::isnan(s.median));
}

TEST(Summary, FindsMeanAndSpreadOfGaussianDraws) {
  // 4 sigma on each of 2 statistics: false alarm 1 in 8,000 per run of another seed.
  constexpr unsigned kSeed = 20181;
  std::mt19937_64 random{kSeed};
  std::normal_distribution<double> draw{7.0, 2.0};
  std::vector<double> values(40'000);
  for (double& v : values) v = draw(random);
  const Summary s = summarise(values);
  const double n = 40'000.0;
  EXPECT_NEAR(s.mean, 7.0, 4.0 * 2.0 / std::sqrt(n)) << "seed " << kSeed;
  EXPECT_NEAR(s.sd, 2.0, 4.0 * 2.0 / std::sqrt(2.0 * n)) << "seed " << kSeed;
  EXPECT_NEAR(s.standard_error, 2.0 / std::sqrt(n), 4.0 * 2.0 / std::sqrt(2.0 * n) / std::sqrt(n));
}

TEST(Quantile, InterpolatesBetweenOrderStatistics) {
  EXPECT_DOUBLE_EQ(quantile({10, 0}, 0.25), 2.5);
  EXPECT_DOUBLE_EQ(quantile({5}, 0.9), 5.0);
  EXPECT_DOUBLE_EQ(quantile({3, 1, 2}, 1.0), 3.0);
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
}

TEST(Running, KeepsSmallVarianceOnALargeMean) {
  // 1e9 ± 1: the sum of squares would lose it in double precision (1e18 has steps of 128).
  Running running;
  for (const double v : {1e9 - 1.0, 1e9, 1e9 + 1.0}) running.add(v);
  EXPECT_DOUBLE_EQ(running.mean(), 1e9);
  EXPECT_DOUBLE_EQ(running.variance(), 1.0);
}

TEST(Explained, IsAllForThePerfectPredictionAndNothingForZero) {
  const std::vector<double> error{1, 2, 3}, zero{0, 0, 0};
  EXPECT_DOUBLE_EQ(explain(error, error).fraction_raw, 1.0);
  EXPECT_DOUBLE_EQ(explain(error, error).fraction_centred, 1.0);
  EXPECT_DOUBLE_EQ(explain(error, zero).fraction_raw, 0.0);
  EXPECT_DOUBLE_EQ(explain(error, zero).residual_rms, explain(error, zero).measured_rms);
}

TEST(Explained, SeparatesAMissingConstantFromTheShape) {
  // The prediction has the whole shape and lacks 10: centred 1, raw 1 − 3·100/(121 + 144 + 169).
  const std::vector<double> error{11, 12, 13}, prediction{1, 2, 3};
  const Explained e = explain(error, prediction);
  EXPECT_DOUBLE_EQ(e.best_offset, 10.0);
  EXPECT_NEAR(e.fraction_centred, 1.0, 1e-12);
  EXPECT_DOUBLE_EQ(e.fraction_raw, 1.0 - 300.0 / 434.0);
  EXPECT_DOUBLE_EQ(e.residual_rms, 10.0);
}

TEST(Explained, IsNegativeForAPredictionWorseThanNone) {
  const std::vector<double> error{1, -1}, prediction{-1, 1};
  EXPECT_DOUBLE_EQ(explain(error, prediction).fraction_raw, -3.0);  // Σ(2e)² = 4 Σe²
}

}  // namespace
}  // namespace toftwin::compare
