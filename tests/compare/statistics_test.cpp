// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/statistics.h"

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <toftwin/nan.h>

namespace toftwin::compare {
namespace {

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

TEST(ClusteredError, OfThreePosesIsThatOfTheirMeans) {
  // Means 1, 3, 8 of equal poses: s = √13, so s/√3, however many pixels each has.
  std::vector<double> values;
  std::vector<std::uint32_t> pose;
  for (int i = 0; i < 300; ++i) {
    const auto p = static_cast<std::uint32_t>(i % 3);
    values.push_back(std::array{1.0, 3.0, 8.0}[p] + (i < 150 ? 0.5 : -0.5));
    pose.push_back(p);
  }
  EXPECT_NEAR(clusteredError(values, pose), std::sqrt(13.0 / 3.0), 1e-12);
}

TEST(ClusteredError, OfIndependentValuesIsTheUsualOne) {
  const std::vector<double> values{4, 1, 3, kNaN, 2};
  EXPECT_DOUBLE_EQ(clusteredError(values, std::vector<std::uint32_t>{0, 1, 2, 3, 4}),
                   summarise(values).standard_error);
}

TEST(ClusteredError, HardlyHangsOnAPoseOfFewPixels) {
  // Sixteen poses of 5000 pixels whose means scatter by 1 mm, and one of three that noise of 20 mm put 30 mm off:
  // 1/√16 mm, known to 1/√30 of itself. By the means alone it would be 1.8 mm.
  constexpr unsigned kSeed = 3;
  std::mt19937_64 random{kSeed};
  std::normal_distribution<double> draw;
  std::vector<double> values;
  std::vector<std::uint32_t> pose;
  for (std::uint32_t p = 0; p < 16; ++p) {
    const double mean = draw(random);
    for (int i = 0; i < 5000; ++i) values.push_back(mean + 20.0 * draw(random)), pose.push_back(p);
  }
  const double without = clusteredError(values, pose);
  EXPECT_NEAR(without, 0.25, 4.0 * 0.25 / std::sqrt(30.0)) << "seed " << kSeed;
  for (const double one : {10.0, 30.0, 50.0}) values.push_back(one), pose.push_back(16);
  EXPECT_NEAR(clusteredError(values, pose), without, 0.05 * without);
}

TEST(ClusteredError, OfOnePoseIsNotKnown) {
  EXPECT_TRUE(std::isnan(clusteredError(std::vector<double>{1, 2, 3}, std::vector<std::uint32_t>(3))));
}

TEST(ClusteredError, IsNotKnownWhereOnePoseHoldsNearlyAllPixels) {
  // 500 pixels of 20,500 that are 30 mm off would make ±21 mm of a mean of 0.7 mm, beside an RMS of 4.7 mm.
  std::vector<double> values(20'500, 0.0);
  std::vector<std::uint32_t> pose(20'500, 0);
  for (std::size_t i = 20'000; i < values.size(); ++i) values[i] = 30.0, pose[i] = 1;
  EXPECT_TRUE(std::isnan(clusteredError(values, pose)));
  // Of two with 75 and 25 %, s = 30/√2.
  values.resize(500), pose.resize(500);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = i < 375 ? 0.0 : 30.0, pose[i] = i < 375 ? 0 : 1;
  EXPECT_NEAR(clusteredError(values, pose), 30.0 / std::sqrt(2.0) * std::sqrt(0.5625 + 0.0625), 1e-9);
}

/// Four poses of 5000 pixels with noise of 1 mm and four of 20 with noise of 200 mm: what these are off by is their
/// own noise, and no pose is off. Σ n_c (m_c − m̄)² is then 200² χ² of four, of which 200² E max(0, χ² − 4) =
/// 200² · 8/e² is taken for poses' scatter, 0.72 mm² of error² (of a set ±1.3); with the variance that all pixels
/// have together it would be all of it, 2.6 mm² (±1.9).
TEST(ClusteredError, IsNotThatOfTheNoiseOfFewPixels) {
  constexpr unsigned kSeed = 5;
  std::mt19937_64 random{kSeed};
  std::normal_distribution<double> draw;
  constexpr int kSets = 40;
  double squares = 0.0;
  for (int set = 0; set < kSets; ++set) {
    std::vector<double> values;
    std::vector<std::uint32_t> pose;
    for (std::uint32_t p = 0; p < 8; ++p) {
      for (int i = 0; i < (p < 4 ? 5000 : 20); ++i)
        values.push_back((p < 4 ? 1.0 : 200.0) * draw(random)), pose.push_back(p);
    }
    const double error = clusteredError(values, pose);
    squares += error * error / kSets;
  }
  EXPECT_LT(squares, 0.72 + 3.0 * 1.3 / std::sqrt(kSets)) << "seed " << kSeed;
}

/// Squares of `side` pixels of one value each, drawn with unit spread, and white noise of 0.5.
Image<float> squares(int side, std::mt19937_64& random) {
  std::normal_distribution<double> draw;
  Image<float> field(256, 256);
  std::vector<double> value(std::size_t{256} * 256);
  for (double& v : value) v = draw(random);
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x) {
      const auto square = static_cast<std::size_t>(y / side * 256 + x / side);
      field(x, y) = static_cast<float>(value[square] + 0.5 * draw(random));
    }
  }
  return field;
}

TEST(BlockedError, SeesThatNeighboursErrAlike) {
  // 256 squares: the mean varies by 1/√256 (and the noise by 0.5/256). Blocks of 16, 32 and 64 pixels,
  // 256, 64 and 16 of them, know it to 4, 9 and 18 %; the largest of three lies over −3 σ of the best
  // and under +4 σ of the worst: false alarm about 1 in 700 and 10,000 for other seeds.
  constexpr unsigned kSeed = 7;
  std::mt19937_64 random{kSeed};
  const double truth = std::hypot(1.0 / 16.0, 0.5 / 256.0);
  const double found = blockedError(squares(16, random));
  EXPECT_GT(found, (1.0 - 3.0 * 0.044) * truth) << "seed " << kSeed;
  EXPECT_LT(found, (1.0 + 4.0 * 0.18) * truth) << "seed " << kSeed;
}

TEST(BlockedError, OfASeriesThatDriftsIsFarOverTheUsualOne) {
  // A ramp of 64 values: the usual error is sd/8; blocks of 8 are the 8 means of a ramp, as good as
  // independent only between blocks: sd/√8.
  std::vector<double> ramp(64);
  for (std::size_t i = 0; i < ramp.size(); ++i) ramp[i] = static_cast<double>(i);
  std::vector<std::uint32_t> block(64);
  for (std::size_t i = 0; i < block.size(); ++i) block[i] = static_cast<std::uint32_t>(i / 8);
  EXPECT_DOUBLE_EQ(blockedError(ramp), clusteredError(ramp, block));
  EXPECT_GT(blockedError(ramp), 2.5 * summarise(ramp).standard_error);
}

TEST(BlockedError, LeavesInvalidPixelsOutAndNeedsSixteen) {
  Image<float> field(8, 8, std::numeric_limits<float>::quiet_NaN());
  for (int i = 0; i < 15; ++i) field[static_cast<std::size_t>(i)] = static_cast<float>(i % 2);
  EXPECT_TRUE(std::isnan(blockedError(field)));
  field[40] = 1.0F;
  EXPECT_TRUE(std::isfinite(blockedError(field)));
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
