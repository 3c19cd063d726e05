// SPDX-License-Identifier: Apache-2.0
// How many trials count as one.
#include "calib/compare/traits/bursts.h"

#include <gtest/gtest.h>

#include <cmath>

namespace toftwin::compare {
namespace {

/// So many bursts of `size`, each after `gap` others.
Trials regular(std::size_t bursts, std::size_t size, std::size_t gap) {
  Trials trials;
  for (std::size_t i = 0; i < bursts; ++i) trials.add(false, gap), trials.add(true, size);
  return trials;
}

constexpr double kNormal = 1.959964, kOfFour = 2.776445;  // quantiles: normal, Student's of four degrees

TEST(Trials, CountByTheBurstThatOneIsIn) {
  // (1 − p) b − p with p = 0.25, b = 8, of five bursts.
  EXPECT_NEAR(regular(5, 8, 24).together(), (0.75 * 8.0 - 0.25) * std::pow(kOfFour / kNormal, 2), 1e-4);
}

TEST(Trials, CountEachWhereNoneFollowsAnother) {
  EXPECT_EQ(regular(20, 1, 9).together(), 1.0);
  EXPECT_EQ(regular(20, 1, 1).together(), 1.0) << "what alternates is not taken for more than independent";
  EXPECT_EQ(Trials{}.together(), 1.0);
}

TEST(Trials, AreTheSameWhicheverOfTwoThingsHappens) {
  EXPECT_DOUBLE_EQ(regular(5, 24, 8).together(), regular(5, 8, 24).together());
}

TEST(Trials, OfTwoSeriesDoNotGoOn) {
  Trials one, two;
  for (Trials* trials : {&one, &two}) {
    for (int i = 0; i < 10; ++i) {
      trials->add(false, 50), trials->add(true, 3);
      if (trials == &two) trials->endSeries();
      trials->add(true, 3), trials->add(false, 50);
    }
  }
  EXPECT_GT(one.together(), 1.9 * two.together());
}

/// Ten times two that are three apart, of bursts 200 apart: 4 in each.
TEST(Trials, JoinBurstsThatAreNearerThanChanceMakesThem) {
  Trials near, joined;
  for (int i = 0; i < 10; ++i) {
    near.add(false, 200), near.add(true, 2), near.add(false, 3), near.add(true, 2);
    joined.add(false, 203), joined.add(true, 4);
  }
  EXPECT_DOUBLE_EQ(near.together(), joined.together());
}

TEST(Trials, TellTheirShare) {
  const Trait share = regular(5, 8, 24).share("lost");
  EXPECT_EQ(share.value, 0.25);
  EXPECT_EQ(share.n, 160u);
  EXPECT_LT(share.low, 0.1);
  EXPECT_GT(share.high, 0.5);
  EXPECT_GT(regular(20, 1, 3).share("lost").low, 0.15);
}

}  // namespace
}  // namespace toftwin::compare
