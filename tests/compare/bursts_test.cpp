// SPDX-License-Identifier: Apache-2.0
// How many trials count as one.
#include "calib/compare/traits/bursts.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>

#include "planted.h"

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

/// Of 600: 12 that happened, in as many bursts of equal size, each after as many others.
TEST(Trials, AreTheLessSureTheFewerBurstsTheyAreIn) {
  double before = 1e9;
  for (const std::size_t bursts : {1u, 2u, 3u, 4u, 6u, 12u}) {
    const double together = regular(bursts, 12 / bursts, 588 / bursts).together();
    EXPECT_LE(together, before) << bursts;
    before = together;
  }
  EXPECT_EQ(before, 1.0);
  EXPECT_DOUBLE_EQ(regular(1, 12, 588).together(), 0.98 * 23.0 - 0.02) << "b = 2 S − 1";
}

/// Three of 600: at once, two and one, or each by itself.
TEST(Trials, OfWhichThreeHappenedAtOnceAreNoSurerThanOfThatManyBursts) {
  const auto width = [](std::initializer_list<std::size_t> sizes) {
    Trials trials;
    for (const std::size_t size : sizes) trials.add(false, 597 / sizes.size()), trials.add(true, size);
    trials.add(false, 597 % sizes.size());
    const Trait share = trials.share("lost");
    return share.high - share.low;
  };
  EXPECT_GE(width({3}), width({2, 1}));
  EXPECT_GT(width({2, 1}), width({1, 1, 1}));
  EXPECT_LT(width({2, 1}), 0.05) << "by Student's quantile of one degree it would be a quarter";
}

/// Such a number of bursts in 2000 trials, each of which goes on by the chance 1 − 1/size: of 400 runs those that have one.
struct Held {
  int runs = 0, held = 0;
};
Held heldOf(double bursts, double size) {
  constexpr int kTrials = 2000;
  Held all;
  for (unsigned seed = 1; seed <= 400; ++seed) {
    Noise noise{seed};
    const double share = bursts * size / kTrials;
    Trials trials;
    bool happens = noise.chance(share), has_one = false;
    for (int i = 0; i < kTrials; ++i) {
      trials.add(happens), has_one = has_one || happens;
      happens = noise.chance(happens ? 1.0 - 1.0 / size : share / (1.0 - share) / size);
    }
    if (!has_one) continue;
    const Trait told = trials.share("lost");
    ++all.runs, all.held += told.low <= share && share <= told.high;
  }
  return all;
}

/// Three bursts of four, or of ten, on the mean: 90 % at least, less three standard errors of so many runs (1.5 %).
TEST(Trials, OfFewBurstsAreHeld) {
  for (const double size : {4.0, 10.0}) {
    const Held all = heldOf(3.0, size);
    EXPECT_GE(all.held, 0.855 * all.runs) << size;
    RecordProperty(fmt::format("held_of_{}", size), fmt::format("{} of {}", all.held, all.runs));
  }
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
