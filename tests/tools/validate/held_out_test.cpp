// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/held_out.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace toftwin::validate {
namespace {

constexpr unsigned kSeed = 20181121;

/// y = 3 + 0.5 x with noise of standard deviation 1 that is shared by blocks of ten rows.
struct NoisyLine {
  std::vector<double> x, y;
};
NoisyLine noisyLine(std::mt19937& random, std::size_t rows) {
  std::normal_distribution<double> noise;
  NoisyLine line;
  double shared = 0.0;
  for (std::size_t i = 0; i < rows; ++i) {
    if (i % 10 == 0) shared = noise(random);
    line.x.push_back(0.1 * static_cast<double>(i));
    line.y.push_back(3.0 + 0.5 * line.x.back() + shared);
  }
  return line;
}

std::vector<Term> constantAndSlope(const std::vector<double>& x) {
  return {{"constant", std::vector<double>(x.size(), 1.0)}, {"slope", x}};
}

TEST(HeldOut, EvenBlocksAreFittedOddOnesJudged) {
  const Blocks blocks = blocksOfRows(6, 2);
  EXPECT_EQ(blocks, (Blocks{0, 0, 1, 1, 2, 2}));
  EXPECT_TRUE(isFitted(2) && isJudged(3) && !isFitted(-2) && !isJudged(-1));
}

TEST(HeldOut, JudgedRowsNeverInfluenceTheFit) {
  std::mt19937 random(kSeed);
  NoisyLine line = noisyLine(random, 200);
  const Blocks blocks = blocksOfRows(200, 10);
  const LinearFit before = fitLinear(line.y, constantAndSlope(line.x), blocks);
  const std::vector<std::vector<Term>> groups{{{"x²", {}}}, {{"cos", {}}}};
  for (std::size_t i = 0; i < line.y.size(); ++i)
    if (isJudged(blocks[i])) line.y[i] = 1e6;
  const LinearFit after = fitLinear(line.y, constantAndSlope(line.x), blocks);
  EXPECT_EQ(before.value, after.value);
  EXPECT_EQ(before.error, after.error);
  EXPECT_EQ(before.fitted_rms, after.fitted_rms);
  EXPECT_GT(after.judged_rms, 1e5);
}

TEST(HeldOut, JackknifeCoversTheTruthWhereNeighboursErrAlike) {
  std::mt19937 random(kSeed);
  int inside = 0;
  constexpr int kTrials = 300;
  for (int trial = 0; trial < kTrials; ++trial) {
    const NoisyLine line = noisyLine(random, 400);
    const LinearFit fit = fitLinear(line.y, constantAndSlope(line.x), blocksOfRows(400, 10));
    inside += std::abs(fit.value[1] - 0.5) < 2.0 * fit.error[1] ? 1 : 0;
  }
  // ±2 standard errors hold 94 % with 20 blocks (Student); 4 σ of a binomial of 300 are 5.5 %.
  // Errors that took rows as independent would be √10 too small and cover 47 %.
  EXPECT_GT(inside, 0.885 * kTrials) << "seed " << kSeed;
}

TEST(HeldOut, ChoosesTheCauseThatIsThereAndNoOther) {
  std::mt19937 random(kSeed);
  std::normal_distribution<double> noise;
  std::vector<double> y;
  std::vector<std::vector<Term>> groups(8);
  for (std::size_t g = 0; g < groups.size(); ++g) groups[g] = {{"cos", {}}, {"sin", {}}};
  for (int i = 0; i < 800; ++i) {
    const double x = 0.02 * i;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const double k = 1.0 + static_cast<double>(g);
      groups[g][0].column.push_back(std::cos(k * x)),
          groups[g][1].column.push_back(std::sin(k * x));
    }
    y.push_back(2.0 * std::sin(3.0 * x) + 0.5 * noise(random));
  }
  const std::vector<Term> constant{{"constant", std::vector<double>(y.size(), 1.0)}};
  const auto chosen = chooseGroups(y, constant, groups, blocksOfRows(y.size(), 20), 3);
  ASSERT_EQ(chosen.size(), 1u) << "seed " << kSeed;
  EXPECT_EQ(chosen[0], 2u);
}

TEST(HeldOut, CurveFitFindsNumbersThatEnterInAnyWay) {
  std::vector<double> x, y;
  for (int i = 0; i < 100; ++i)
    x.push_back(0.1 * i), y.push_back(5.0 * std::exp(-x.back() / 2.5) + 1.0);
  const Bounded numbers[] = {{1.0, 0.0, 100.0}, {1.0, 0.1, 50.0}, {0.0, -10.0, 10.0}};
  const CurveFit fit = fitCurve(
      y, numbers,
      [&](std::span<const double> p) {
        std::vector<double> line;
        for (const double at : x) line.push_back(p[0] * std::exp(-at / p[1]) + p[2]);
        return line;
      },
      blocksOfRows(x.size(), 5));
  EXPECT_NEAR(fit.value[0], 5.0, 1e-4);
  EXPECT_NEAR(fit.value[1], 2.5, 1e-4);
  EXPECT_NEAR(fit.value[2], 1.0, 1e-4);
  EXPECT_LT(fit.judged_rms, 1e-4);
}

}  // namespace
}  // namespace toftwin::validate
