// SPDX-License-Identifier: Apache-2.0
// Effects of the catalogue whose numbers are far from its defaults, from which a search starts.
#include <cmath>

#include <gmock/gmock.h>

#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

using testing::ElementsAre;

class OfOtherNumbers : public Searched {
 protected:
  [[nodiscard]] CampaignFinding found(const std::string& name, const std::string& keys) const {
    simulate("[[effect]]\ntype = '" + name + "'\n" + keys + "\n");
    return search(job());
  }
  static const FittedNumber& numberOf(const CampaignFinding& finding, const std::string& key) {
    const auto& numbers = finding.effects.at(0).fitted.value().numbers;
    return *std::ranges::find(numbers, key, &FittedNumber::key);
  }
};

/// A ghost that went by steps of half a pixel told nothing of where it goes: it was not named, but learned as squares
/// and curves, in minutes.
TEST_F(OfOtherNumbers, AGhostAboutAnotherPointIsNamedWithThatPoint) {
  const CampaignFinding finding = found("lens_ghost", "share = 0.02\nright_px = -1.4\ndown_px = 2.3");
  ASSERT_THAT(namesOf(finding), ElementsAre("lens_ghost")) << verdictOf(finding);
  EXPECT_NEAR(numberOf(finding, "right_px").value, -1.4, 0.2);
  EXPECT_NEAR(numberOf(finding, "down_px").value, 2.3, 0.2);
}

/// Columns were looked at for periods of 2, 4 and 8 only.
TEST_F(OfOtherNumbers, AColumnCombOfFiveIsNamedWithItsPeriod) {
  const CampaignFinding finding = found("column_comb", "period = 5\noffset_electrons = 40\ngain = 0.004");
  ASSERT_THAT(namesOf(finding), ElementsAre("column_comb")) << verdictOf(finding);
  EXPECT_EQ(std::get<sim::ColumnComb>(finding.effects.front().fitted->effect).period, 5);
}
TEST_F(OfOtherNumbers, StripesThatRepeatAfterSixColumnsAreLearnedAsThat) {
  const CampaignFinding finding = searchWithout("column_comb", "period = 6\noffset_electrons = 40\ngain = 0.004");
  ASSERT_EQ(finding.effects.size(), 1U) << verdictOf(finding);
  EXPECT_THAT(finding.effects.front().found.covariates, ElementsAre("column", "converter"));
  for (const terms::Term& term : std::get<sim::Learned>(finding.effects.front().fitted->effect).terms.list())
    EXPECT_EQ(term.factors.front().numbers.front(), 6.0) << toText(term);
  ASSERT_TRUE(finding.judgement);
  EXPECT_GT(finding.judgement->removed, 0.7) << verdictOf(finding);
}

/// Range and amplitude tell the product of the share that is taken and the contrast that it costs. With the other as it
/// is by default, an error of the share's own said 0.31 ± 0.006 of 0.72.
TEST_F(OfOtherNumbers, ANumberIsAsUncertainAsWhatItIsNotToldFrom) {
  const CampaignFinding finding = found("ambient_suppression", "share = 0.7\ncontrast_loss_per_electron = 4.5e-8");
  ASSERT_FALSE(finding.effects.empty());
  ASSERT_EQ(namesOf(finding).front(), "ambient_suppression") << verdictOf(finding);
  const FittedNumber& share = numberOf(finding, "share");
  EXPECT_LT(std::abs(share.value - 0.7), 2.0 * share.error);
  EXPECT_GT(share.error, 0.5 * share.value);
}

}  // namespace
}  // namespace toftwin::discover
