// SPDX-License-Identifier: Apache-2.0
// Several poses: which are one place, and what changed between two visits.
#include <cmath>

#include <gtest/gtest.h>

#include "calib/compare/characteristics.h"
#include "calib/compare/drift.h"
#include "planted_stacks.h"

namespace toftwin::compare {
namespace {

TEST(Places, OfAPoseVisitedTwiceAreOne) {
  const std::vector<PoseComparison> poses{poseOffBy(0.0, 0.0, 1), poseOffBy(0.0, 0.1, 2),
                                          poseOffBy(0.0, 0.0, 3)};
  EXPECT_EQ(placesOf(poses), (std::vector<std::uint32_t>{0, 1, 0}));
  EXPECT_EQ(characterise(poses).places, 2U);
}

TEST(Places, OfUnknownPosesAreEachTheirOwn) {
  std::vector<PoseComparison> poses(2);
  EXPECT_EQ(placesOf(poses), (std::vector<std::uint32_t>{0, 1}));
}

TEST(Drift, IsWhatChangedBetweenTwoVisitsOfOnePose) {
  const std::vector<PoseComparison> poses{poseOffBy(0.001, 0.0, 1), poseOffBy(0.009, 0.1, 2),
                                          poseOffBy(0.003, 0.0, 3)};
  const auto drifts = driftsOf(poses);
  ASSERT_EQ(drifts.size(), 1U);
  EXPECT_EQ(drifts[0].first, 0U);
  EXPECT_EQ(drifts[0].last, 2U);
  EXPECT_EQ(drifts[0].pixels, static_cast<std::size_t>(kWidth * kHeight));
  // A difference of two means, each of the noise above: 4 σ is 1 in 16,000 for other seeds.
  EXPECT_NEAR(drifts[0].difference_mm, 2.0, 4.0 * std::sqrt(2.0) * kMeanError_mm);
  EXPECT_NEAR(drifts[0].b_mm - drifts[0].a_mm, drifts[0].difference_mm, 1e-9);
  EXPECT_NEAR(drifts[0].a_mm, 0.0, 4.0 * kMeanError_mm);
  // Independent pixels: at least sd/√n (known to 1.3 %), and at most 4 times 27 % of 8 blocks over it.
  EXPECT_GT(drifts[0].error_mm, 0.94 * std::sqrt(2.0) * kMeanError_mm);
  EXPECT_LT(drifts[0].error_mm, 2.1 * std::sqrt(2.0) * kMeanError_mm);
}

TEST(Drift, IsNotToldWhereNoPoseComesAgain) {
  EXPECT_TRUE(driftsOf({poseOffBy(0.001, 0.0, 1), poseOffBy(0.009, 0.1, 2)}).empty());
}

TEST(Trend, HasNoErrorWhereOnlyOnePlaceIsSeen) {
  const Trend trend = trendOf({1, 2, 3, 4}, {10, 14, 20, 30}, {0, 1, 1, 1}, 2);
  // Two places with one value each: s = 4/√2, error = s/√2 = 2.
  EXPECT_DOUBLE_EQ(trend.low[0], 12.0 - 4.0);
  EXPECT_DOUBLE_EQ(trend.high[0], 12.0 + 4.0);
  EXPECT_TRUE(std::isnan(trend.low[1]));
}

TEST(Trend, GivesTheMeanOfEachEquallyFilledBin) {
  const Trend trend = trendOf({4, 1, 2, 3}, {40, 10, 20, 30}, {0, 0, 1, 1}, 2);
  EXPECT_EQ(trend.x, (std::vector<double>{1.5, 3.5}));
  EXPECT_EQ(trend.y, (std::vector<double>{15, 35}));
}

}  // namespace
}  // namespace toftwin::compare
