// SPDX-License-Identifier: Apache-2.0
// What is said of the share that a model removes holds as often as it says.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "calib/discover/campaign/answer/removed_share.h"

namespace toftwin::discover {
namespace {

/// Of χ² = 400 removed, 20 of its standard deviations, and nothing to half of that left, of which noise says 40 more or
/// less: 95 % of 100 intervals hold it, or more. That 85 or fewer do has a chance of 1.4e-4 for each of the four.
TEST(RemovedShare, IsInItsInterval) {
  std::mt19937_64 random{20266};
  std::normal_distribution<double> normal;
  for (const double left : {0.0, 10.0, 40.0, 200.0}) {
    const Balance truth{400.0, left}, sigma{20.0, 40.0};
    int in = 0;
    for (int k = 0; k < 100; ++k) {
      const ShareInterval said = intervalOf(
          {truth.removed + sigma.removed * normal(random), truth.left + sigma.left * normal(random)}, sigma);
      in += said.low <= shareOf(truth) && shareOf(truth) <= said.high ? 1 : 0;
    }
    EXPECT_GE(in, 86) << left;
  }
}

/// Three standard deviations of noise too little left are no proof that nothing is: of what is known not to be negative
/// then, the 95 % end at 0.99 standard deviations (P(z > 3.99) = 0.025 P(z > 3)).
TEST(RemovedShare, IsNotCertainWhereNoiseLeavesTooLittle) {
  const ShareInterval said = intervalOf({400.0, -120.0}, {1e-6, 40.0});
  EXPECT_DOUBLE_EQ(said.high, 1.0);
  EXPECT_NEAR(said.low, 400.0 / (400.0 + 0.99 * 40.0), 0.01);
}

TEST(RemovedShare, IsNotKnownWhereNoRowSaysAnything) {
  const ShareInterval of_nothing = intervalOf({0.0, 0.0}, {0.0, 0.0}), of_nan = intervalOf({400.0, NAN}, {20.0, 40.0});
  EXPECT_TRUE(std::isnan(of_nothing.low) && std::isnan(of_nothing.high));
  EXPECT_TRUE(std::isnan(of_nan.low) && std::isnan(of_nan.high));
}

}  // namespace
}  // namespace toftwin::discover
