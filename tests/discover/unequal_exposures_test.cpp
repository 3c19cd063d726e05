// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/unequal_exposures.h"

#include <gmock/gmock.h>

#include "calib/discover/campaign/model_file.h"
#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;

TEST(UnequalExposures, NeedFourStepsOrAMultiple) {
  EXPECT_THAT(unequalExposures(3, 2), IsEmpty());
  EXPECT_THAT(unequalExposures(6, 2), IsEmpty());
  EXPECT_THAT(unequalGroups({}), IsEmpty());
  const auto eight = unequalExposures(8, 2);
  ASSERT_EQ(eight.size(), 4U);
  EXPECT_EQ(std::get<sim::SampleGain>(eight.back().second.front()).step, 2);
}

TEST(UnequalExposures, OfOneTapHaveItsChargeAlready) {
  const auto carriers = unequalExposures(4, 1);
  ASSERT_EQ(carriers.size(), 3U);
  EXPECT_EQ(carriers.front().second.size(), 1U);
}

TEST(UnequalExposures, BecomeOneGainForEachTapAndOnePhase) {
  const auto carriers = unequalExposures(4, 2);
  const std::vector<TermGroup> groups = unequalGroups(carriers);
  std::vector<std::pair<Term, double>> terms;
  for (const Term& term : groups.back().terms) terms.emplace_back(term, 1.0 + static_cast<double>(terms.size()));
  const auto learned = unequalOf(carriers, terms);
  ASSERT_EQ(learned.size(), 4U);
  const auto gainOf = [&](std::size_t i) { return std::get<sim::SampleGain>(learned[i].effect); };
  EXPECT_DOUBLE_EQ(gainOf(0).gain, 0.01 + 0.03);  // both taps, and the first alone
  EXPECT_DOUBLE_EQ(gainOf(1).gain, 0.01);
  EXPECT_EQ(gainOf(1).tap, 1);
  EXPECT_DOUBLE_EQ(std::get<sim::StepPhase>(learned[2].effect).error.in(radian), 0.02);
  EXPECT_EQ(gainOf(3).step, 1);
  EXPECT_DOUBLE_EQ(gainOf(3).gain, 0.04);
  for (const LearnedEffect& one : learned) {
    ASSERT_EQ(one.free.size(), 1U);
    EXPECT_NO_THROW(static_cast<void>(valueOf(one.effect, one.free.front())));
    EXPECT_NE(valueOf(one.effect, one.free.front()), 0.0) << "a free number that the effect does not have";
  }
}

/// The charge that a tap's gain makes of ambient light was not told, as a gain along the range says half of it.
TEST_F(Searched, ATapThatIsAmplifiedMoreIsOneEffectOfTheSamples) {
  const CampaignFinding finding = searchWithout("sample_gain", "step = 1\ngain = 0.01");
  ASSERT_EQ(finding.effects.size(), 1U) << verdictOf(finding);
  const Effect& found = finding.effects.front().found;
  EXPECT_THAT(found.covariates, ElementsAre("amplified", "unequal"));
  EXPECT_EQ(found.stage, Stage::Samples);
  EXPECT_THAT(found.stages_alike, IsEmpty());
  const auto model = sim::SensorModel::parse(finding.model_toml, "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  ASSERT_TRUE(finding.judgement);
  EXPECT_GT(finding.judgement->removed, 0.9) << verdictOf(finding);
  const FittedEffect* of_tap = nullptr;
  for (const FittedEffect& more : finding.effects.front().more)
    if (const auto* gain = std::get_if<sim::SampleGain>(&more.effect); gain != nullptr && gain->step == 1) of_tap = &more;
  ASSERT_NE(of_tap, nullptr);
  ASSERT_EQ(of_tap->numbers.size(), 1U);
  // Three standard errors: a false alarm in 0.3 %, of one seed that is always the same.
  EXPECT_NEAR(of_tap->numbers.front().value, 0.01, 3.0 * of_tap->numbers.front().error);
}

TEST_F(Searched, ALateRawExposureWithoutANameIsUnequal) {
  const CampaignFinding finding = searchWithout("step_phase", "step = 1\nerror_rad = 0.02");
  ASSERT_EQ(finding.effects.size(), 1U) << verdictOf(finding);
  const Effect& found = finding.effects.front().found;
  EXPECT_THAT(found.covariates, ElementsAre("unequal"));
  EXPECT_EQ(found.stage, Stage::Light);
  ASSERT_TRUE(finding.judgement);
  EXPECT_GT(finding.judgement->removed, 0.9) << verdictOf(finding);
}

}  // namespace
}  // namespace toftwin::discover
