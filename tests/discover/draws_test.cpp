// SPDX-License-Identifier: Apache-2.0
// Draws that are the same on every machine.
#include <map>
#include <numeric>
#include <vector>

#include <gmock/gmock.h>

#include "calib/discover/draws.h"

namespace toftwin::discover {
namespace {

TEST(Draws, AShuffleIsTheSameEverywhere) {
  std::vector<int> order(8);
  std::iota(order.begin(), order.end(), 0);
  Draws{1}.shuffle(order);
  EXPECT_THAT(order, testing::ElementsAre(4, 6, 3, 5, 1, 7, 2, 0));
}

/// Each of the six orders of three 2000 ± 41 times in 12,000.
TEST(Draws, EachOrderIsAsLikely) {
  Draws draws{2};
  std::map<std::vector<int>, int> times;
  for (int i = 0; i < 12'000; ++i) {
    std::vector<int> order{0, 1, 2};
    draws.shuffle(order);
    ++times[order];
  }
  ASSERT_EQ(times.size(), 6U);
  for (const auto& [order, count] : times) EXPECT_NEAR(count, 2000, 4 * 41);
}

}  // namespace
}  // namespace toftwin::discover
