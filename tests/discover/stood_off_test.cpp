// SPDX-License-Identifier: Apache-2.0
// A place where the camera was bumped is set aside where it matters, and nothing else is.
#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "calib/discover/campaign/search/places.h"
#include "calib/discover/campaign/search/stood_off.h"
#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

std::vector<double> gaussian(std::mt19937_64& random, std::size_t n) {
  std::normal_distribution<double> normal;
  std::vector<double> all(n);
  for (double& one : all) one = 0.7 + normal(random);  // where the rig's zero lies nobody knows
  return all;
}

using Indices = std::vector<std::size_t>;

TEST(FarOff, AreThoseThatWereBumped) {
  std::mt19937_64 random{20263};
  std::vector<double> places = gaussian(random, 45);
  EXPECT_EQ(farOff({places}, 2, 1e-3), Indices{});
  places[17] += 10.0;
  EXPECT_EQ(farOff({places}, 1, 1e-3), Indices{17});
  EXPECT_EQ(farOff({places}, 2, 1e-3), Indices{17});
}

/// Beside each other neither is twice as far as any other; one is off in another way.
TEST(FarOff, TwoDoNotHideEachOther) {
  std::mt19937_64 random{20266};
  std::vector<double> right = gaussian(random, 45), down = gaussian(random, 45);
  right[3] += 12.0, right[30] -= 9.0;
  EXPECT_EQ(farOff({right, down}, 1, 1e-3), Indices{});
  EXPECT_EQ(farOff({right, down}, 2, 1e-3), (Indices{3, 30}));
  right[30] += 9.0, down[30] = 14.0, down[5] = NAN;
  EXPECT_EQ(farOff({right, down}, 2, 1e-3), (Indices{3, 30}));
}

/// 20,000 lists of 12, or 10, in which one of 20 may be wrong: 1000 are expected at most; the bound on the largest of
/// twelve is nearly exact, but the rule that it stands apart takes some, and where several may be off each set of them
/// is another chance, which leaves each of them less. More than 1000 + 5 √950 has a chance of 3e-7.
TEST(FarOff, IsSeldomChance) {
  for (const auto& [count, most] : {std::pair{12U, 1U}, std::pair{12U, 2U}, std::pair{10U, 5U}}) {
    std::mt19937_64 random{20264};
    int wrong = 0;
    for (int k = 0; k < 20'000; ++k) wrong += farOff({gaussian(random, count)}, most, 0.05).empty() ? 0 : 1;
    EXPECT_LT(wrong, 1000 + 155) << most;
    EXPECT_GT(wrong, 100) << most;
  }
}

/// A hundred captures, of which two or three moved alike: Student's t of one of two is 9.8. What a warm-up does to its
/// first, too.
TEST(FarOff, IsNoneWhereOthersMovedAsWell) {
  std::mt19937_64 random{20265};
  std::vector<double> places = gaussian(random, 100);
  places[3] += 60.0, places[70] += 50.0;
  EXPECT_EQ(farOff({places}, 1, 1e-3), Indices{});
  places[20] += 40.0;
  EXPECT_EQ(farOff({places}, 2, 1e-3), Indices{});
  places = gaussian(random, 100);
  for (std::size_t i = 0; i < 10; ++i) places[i] += 25.0 * std::exp(-0.27 * static_cast<double>(i));
  EXPECT_EQ(farOff({places}, 5, 1e-3), Indices{});
  EXPECT_EQ(farOff({{0.0, 0.1, -0.1, 0.05, 30.0}}, 1, 1e-3), Indices{}) << "too few to say what is usual";
}

/// Five captures with an offset of 0 and one, 30 times as far off as its noise says, with one of 8 mm.
TEST(TemperOf, OneCaptureDoesNotMoveWhatIsCommon) {
  Evidence evidence;
  evidence.groups = commonGroups();
  for (int c = 0; c < 6; ++c) {
    const double off = c == 5 ? 8.0 : 0.0, rows = 100.0, weight = c == 5 ? 1e4 : 1e2;
    CaptureEvidence one{.gram = Eigen::MatrixXd::Zero(kCommon, kCommon), .moment = Eigen::VectorXd::Zero(kCommon)};
    one.gram(0, 0) = weight * rows, one.moment[0] = weight * rows * off;
    one.energy = rows + weight * rows * off * off + (c == 5 ? 900.0 * rows : 0.0), one.rows = rows;
    evidence.captures.push_back(one);
  }
  const auto offsetOf = [](const Evidence& of) {
    const Marginal marginal = marginalise(of, {});
    return fit(marginal, nuisanceColumns(marginal)).coefficient[0];
  };
  EXPECT_GT(offsetOf(evidence), 7.0);
  EXPECT_LT(std::abs(offsetOf(weighed(evidence, temperOf(evidence, {})))), 0.5);
  evidence.captures.pop_back();
  EXPECT_THAT(temperOf(evidence, {}), testing::Each(1.0));
}

/// So far off that light traced once where the camera probably stood leaves something (p = 0.0025).
TEST_F(Searched, ABumpedCaptureIsSetAside) {
  bumped_ = {9};
  simulate("", {}, true, 0, 23);
  const CampaignFinding finding = search(job());
  EXPECT_TRUE(finding.effects.empty()) << verdictOf(finding);
  EXPECT_GT(finding.finding.first_p, 0.01);
  ASSERT_EQ(finding.off.size(), 1U);
  EXPECT_TRUE(finding.off.front().is_set_aside);
  EXPECT_EQ(finding.off.front().number, 9U);
  EXPECT_THAT(verdictOf(finding), testing::HasSubstr("Set aside: capture 9"));
  EXPECT_THAT(finding.notes, testing::Contains(testing::HasSubstr("It is set aside")));
}

/// Capture 25 is a locked one.
TEST_F(Searched, ALockedCaptureThatWasBumpedIsTold) {
  bumped_ = {25};
  simulate("[[effect]]\ntype = 'vignetting'\nexponent = 1.5\n");
  const CampaignFinding finding = search(job());
  EXPECT_THAT(namesOf(finding), testing::ElementsAre("vignetting"));
  EXPECT_TRUE(finding.off.empty());
  ASSERT_EQ(finding.locked_off.size(), 1U);
  EXPECT_EQ(finding.locked_off.front().number, 25U);
  EXPECT_FALSE(finding.is_worse);
  ASSERT_TRUE(finding.judgement && finding.without_off);
  EXPECT_EQ(finding.without_off->captures.size() + 1, finding.judgement->captures.size());
  // Noise alone moves χ² per row by a fiftieth.
  EXPECT_GT(finding.judgement->after.per_row, 1.1 * finding.without_off->after.per_row);
  EXPECT_THAT(finding.notes, testing::Contains(testing::HasSubstr("It is judged with the others. With it: RMS")));
}

/// An effect of the ambient light would be there alone, too.
TEST_F(Searched, ACaptureThatAloneHasItsAmbientLightIsNotSetAside) {
  bumped_ = {43};
  simulate("", {}, true, 0, 25);  // without it nothing is left: p = 0.13
  CampaignJob open = job();
  open.open_locked = false;
  const CampaignFinding finding = search(open);
  ASSERT_EQ(finding.off.size(), 1U) << verdictOf(finding);
  EXPECT_EQ(finding.off.front().number, 43U);
  EXPECT_EQ(finding.off.front().alone, "40 klx");
  EXPECT_FALSE(finding.off.front().is_set_aside);
  EXPECT_THAT(finding.notes, testing::Contains(testing::HasSubstr("none of which was at 40 klx")));
}

}  // namespace
}  // namespace toftwin::discover
