// SPDX-License-Identifier: Apache-2.0
// Light from another place of the image, of which the catalogue knows nothing.
#include <gmock/gmock.h>

#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

using testing::Contains;

using OfAnotherPlace = Searched;

TEST_F(OfAnotherPlace, PixelsThatLookFartherInAreATableOverTheRadius) {
  const CampaignFinding finding = searchWithout("distortion_misfit", "focal_error = 0.02");
  ASSERT_FALSE(finding.effects.empty());
  EXPECT_THAT(finding.effects.front().found.covariates, testing::ElementsAre("outward", "radius_px"))
      << verdictOf(finding);
  const auto model = sim::SensorModel::parse(finding.model_toml, "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_THAT(model->effectNames(), Contains("learned"));
  ASSERT_TRUE(finding.judgement);
  EXPECT_GT(finding.judgement->removed, 0.7) << verdictOf(finding);
}

TEST_F(OfAnotherPlace, ASecondImageIsAKernelAboutTheMirroredPlace) {
  const CampaignFinding finding = searchWithout("lens_ghost", "share = 0.02\nright_px = 0.5\ndown_px = 0");
  ASSERT_FALSE(finding.effects.empty());
  EXPECT_THAT(finding.effects.front().found.covariates, Contains("mirrored")) << verdictOf(finding);
  const auto model = sim::SensorModel::parse(finding.model_toml, "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_THAT(model->effectNames(), Contains("learned"));
  ASSERT_TRUE(finding.judgement);
  EXPECT_GT(finding.judgement->removed, 0.7) << verdictOf(finding);
}

/// What turns the image need not be at the principal point: what squares about that leave goes along columns and rows,
/// and was told as a second effect.
TEST_F(OfAnotherPlace, ASecondImageAboutAPointBesideThePrincipalOneIsOneEffect) {
  const CampaignFinding finding = searchWithout("lens_ghost", "share = 0.02\nright_px = 1\ndown_px = -1");
  ASSERT_EQ(finding.effects.size(), 1U) << verdictOf(finding);
  EXPECT_THAT(finding.effects.front().found.covariates, Contains("mirrored")) << verdictOf(finding);
  ASSERT_TRUE(finding.effects.front().fitted);
  const terms::Term* mirror = std::get<sim::Learned>(finding.effects.front().fitted->effect).terms.mirror();
  ASSERT_NE(mirror, nullptr);
  EXPECT_NEAR(mirror->carried[1], 1.0, 0.5);
  EXPECT_NEAR(mirror->carried[2], -1.0, 0.5);
  ASSERT_TRUE(finding.judgement);
  EXPECT_GT(finding.judgement->removed, 0.9) << verdictOf(finding);
}

/// What all columns' charges have in common was told as a second effect.
TEST_F(Searched, StripesThatRepeatAreOneEffectWithItsForm) {
  const CampaignFinding finding = searchWithout("column_comb", "offset_electrons = 40\ngain = 0.004");
  ASSERT_EQ(finding.effects.size(), 1U) << verdictOf(finding);
  EXPECT_THAT(finding.effects.front().found.covariates, testing::ElementsAre("column", "converter"));
  ASSERT_TRUE(finding.effects.front().fitted);
  for (const terms::Term& term : std::get<sim::Learned>(finding.effects.front().fitted->effect).terms.list())
    EXPECT_EQ(term.factors.front().numbers.front(), 4.0) << toText(term);
  const auto model = sim::SensorModel::parse(finding.model_toml, "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_THAT(model->effectNames(), Contains("learned"));
  ASSERT_TRUE(finding.judgement);
  EXPECT_GT(finding.judgement->removed, 0.7) << verdictOf(finding);
}

}  // namespace
}  // namespace toftwin::discover
