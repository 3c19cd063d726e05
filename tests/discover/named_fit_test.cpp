// SPDX-License-Identifier: Apache-2.0
// An effect of the catalogue, fitted to a campaign: which of its strengths count.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "calib/discover/campaign/answer/discover_campaign.h"
#include "calib/discover/campaign/captures/catalogue.h"
#include "calib/discover/campaign/rows/rows.h"
#include "calib/plan/opened.h"
#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

using testing::UnorderedElementsAre;

/// What a propagation delay does at a few places, and nothing that any other effect does.
std::vector<float> ofDelays(const Variation& variation) {
  const auto* const off = std::get_if<sim::PropagationDelay>(&variation.off);
  const auto* const on = std::get_if<sim::PropagationDelay>(&variation.on);
  if (off == nullptr || on == nullptr) return {};
  std::vector<float> change;
  for (const auto& [x, y] : {std::pair{-20.0, -15.0}, {20.0, -10.0}, {-10.0, 15.0}, {5.0, 5.0}}) {
    const auto delay = [&](const sim::PropagationDelay& one) {
      return x * one.per_column.in(millimetre) + y * one.per_row.in(millimetre) +
             std::abs(y) * one.per_row_from_middle.in(millimetre);
    };
    change.push_back(static_cast<float>(delay(*on) - delay(*off)));
    change.push_back(0.0F);  // the amplitude
  }
  return change;
}

/// Two of its strengths are 0 in the defaults as well as where it is off.
TEST(Candidates, AreStrongByAllNumbersThatDoSomethingAlone) {
  const auto candidates = candidatesOf(ofDelays, {}, {});
  ASSERT_EQ(candidates.size(), 1U);
  EXPECT_THAT(candidates.front().strengths,
              UnorderedElementsAre("per_column_mm", "per_row_mm", "per_row_from_middle_mm"));
}

/// Seed 1 of the small campaign: a strength of several that does nothing is within two standard errors of
/// nothing in 95 % of such fits, and predicts other captures better by a standard error in few of the others.
TEST(NamedFits, HaveOnlyTheStrengthsThatAreNeeded) {
  const auto folder =
      std::filesystem::temp_directory_path() / fmt::format("toftwin-named-fit-{}", ::getpid());
  const auto plan = plan::parsePlan(smallPlan(), "plan.toml");
  const auto camera = sim::SensorModel::parse(
      smallCamera() + "[[effect]]\ntype = 'propagation_delay'\nper_column_mm = 0.05\n", "camera.toml");
  const auto declared = sim::SensorModel::parse(smallCamera(), "camera.toml");
  const auto scene = sim::Scene::parse(smallScene(), "scene.toml");
  ASSERT_TRUE(plan && camera && declared && scene);
  write(SimulatedRun{.plan = *plan, .camera = *camera, .scene = *scene}, folder);
  const auto campaign = readCampaign(folder, Side::A);
  ASSERT_TRUE(campaign.ok()) << campaign.error().message;
  const Declared known{*declared, *scene};
  const auto traced = traceAll(known, campaign->captures, {.max_surfaces = 1});
  ASSERT_TRUE(traced.ok()) << traced.error().message;
  const Lights lights = lightsOf(*traced);
  const auto rows = CampaignRows::make(known, {campaign->captures, *traced, lights}, {});
  ASSERT_TRUE(rows.ok()) << rows.error().message;
  const std::vector<std::string> names{"propagation_delay"};
  const auto fits = rows->fitNamed(names, {}, {});
  std::filesystem::remove_all(folder);
  ASSERT_EQ(fits.size(), 1U);
  ASSERT_EQ(fits.front().numbers.size(), 1U);
  const Estimate& only = fits.front().numbers.front();
  EXPECT_EQ(only.name, "per_column_mm");
  EXPECT_NEAR(only.value, 0.05, 4.0 * only.error);  // once in 16,000
  EXPECT_GT(only.value, 10.0 * only.error);
}

/// Of four samples neither the second nor the fourth harmonic is in any range: to write one of them, as rounding left
/// it, would bend raw exposures.
TEST_F(Searched, ANumberThatNothingTellsStaysAtNothing) {
  std::string camera = tinyCamera();
  camera.replace(camera.find("taps = 2"), 8, "taps = 2\nharmonics = 5");
  simulateWith(camera + "[[effect]]\ntype = 'harmonics'\nsecond = 0.1\nthird = 0.003\n");
  write("camera.toml", camera);
  const CampaignFinding finding = search(job());
  ASSERT_THAT(namesOf(finding), testing::ElementsAre("harmonics")) << verdictOf(finding);
  const auto& found = std::get<sim::Harmonics>(finding.effects.front().fitted->effect);
  EXPECT_NEAR(found.third, 0.003, 3e-4);
  EXPECT_NEAR(found.fourth, 0.0, 0.05);  // where rounding passes for a little of it; -1 if it is written as it fell
  EXPECT_NEAR(found.second, 0.0, 0.2);
  // Steps that shrank with what was left of it said 1e-7 ± 3e-6 of 0.1.
  for (const FittedNumber& number : finding.effects.front().fitted->numbers)
    EXPECT_TRUE(number.key != "second" || std::abs(number.value - 0.1) < 3.0 * number.error) << number.error;
}

/// A veil and a halo answer for each other: each number's error is half as large as it or more, and yet there is no
/// doing without the halo (χ² of 20 and more).
TEST_F(Searched, NumbersThatAnswerForEachOtherAreNotBothNeedless) {
  for (const std::uint64_t seed : {1U, 5U, 11U}) {
    simulate("[[effect]]\ntype = 'lens_scatter'\nveil = 0.002\nhalo = 0.004\n", {}, true, 0, seed);
    std::filesystem::remove(folder_ / "run" / plan::openedFile(plan::OpenedOf::A));
    const CampaignFinding finding = search(job());
    ASSERT_THAT(namesOf(finding), testing::ElementsAre("lens_scatter")) << seed << ": " << verdictOf(finding);
    const auto& numbers = finding.effects.front().found.numbers;
    const auto halo = std::ranges::find(numbers, "halo", &Estimate::name);
    ASSERT_NE(halo, numbers.end()) << seed;
    EXPECT_LT(halo->value, 2.0 * halo->error) << seed << ": its error alone would let it go";
    EXPECT_NEAR(halo->value, 0.004, 4.0 * halo->error) << seed;
  }
}

}  // namespace
}  // namespace toftwin::discover
