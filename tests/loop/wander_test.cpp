// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>

#include "calib/loop/wander.h"

namespace toftwin::loop {
namespace {

/// An AR(1) process of variance 1 and correlation 0.9 beside white noise of variance 0.25.
Eigen::VectorXd wandering(Eigen::Index rows, std::uint64_t seed) {
  std::mt19937_64 random{seed};
  std::normal_distribution<double> normal;
  Eigen::VectorXd out(rows);
  double slow = normal(random);
  for (Eigen::Index i = 0; i < rows; ++i) {
    out[i] = slow + 0.5 * normal(random);
    slow = 0.9 * slow + std::sqrt(1.0 - 0.81) * normal(random);
  }
  return out;
}

TEST(Wander, IsToldFromWhiteNoise) {
  const std::vector<int> group(2000, 0);
  const Wander slow = fitWander(wandering(2000, 5), group);
  EXPECT_EQ(slow.keeps, 0.9);
  EXPECT_NEAR(slow.slow, 1.0, 0.35);  // 2000 rows are some hundred independent ones
  std::mt19937_64 random{6};
  std::normal_distribution<double> normal;
  Eigen::VectorXd white(2000);
  for (double& w : white) w = normal(random);
  EXPECT_LT(fitWander(white, group).slow, 0.15);
}

TEST(Wander, PredictsABlockFromBothSidesBetterThanNothing) {
  const Eigen::VectorXd rows = wandering(2000, 7);
  std::vector<int> group(2000, 0), block(2000);
  for (int i = 0; i < 2000; ++i) block[static_cast<std::size_t>(i)] = i / 5;
  const Wander wander{.slow = 1.0, .keeps = 0.9, .white = 0.25};
  const Eigen::VectorXd predicted = predictBlocks(rows, group, block, wander);
  // In the middle of five the process is known from both sides to 1 − 2·0.9⁶/(1 + 0.9⁶) of its variance or better.
  EXPECT_LT((rows - predicted).squaredNorm(), 0.75 * rows.squaredNorm());
}

TEST(Wander, OfOneBlockThatIsAllPredictsNothing) {
  const Eigen::VectorXd rows = wandering(50, 8);
  const std::vector<int> group(50, 0), block(50, 0);
  EXPECT_LT(predictBlocks(rows, group, block, {.slow = 1.0, .keeps = 0.9, .white = 0.25}).cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace toftwin::loop
