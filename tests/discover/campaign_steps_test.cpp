// SPDX-License-Identifier: Apache-2.0
// Whole steps of the converter, which single frames show.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include <gmock/gmock.h>

#include "calib/discover/campaign/rows/pose_errors.h"
#include "calib/plan/opened.h"
#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

/// Steps of a third of the dimmest pixels' noise: means over frames do not show them.
TEST_F(Searched, StepsOfTheConverterAreSeenInSingleFrames) {
  simulate("[[effect]]\ntype = 'quantisation'\nstep_electrons = 20.0\n");
  const CampaignFinding finding = search(job());
  ASSERT_THAT(namesOf(finding), ElementsAre("quantisation")) << verdictOf(finding);
  EXPECT_THAT(verdictOf(finding), HasSubstr("single frames"));
  ASSERT_TRUE(finding.steps_p);
  EXPECT_LT(*finding.steps_p, 1e-6);
  EXPECT_GT(finding.finding.first_p, 0.01) << "of another test";
  ASSERT_TRUE(finding.effects.front().fitted);
  const FittedNumber step = finding.effects.front().fitted->numbers.at(0);
  EXPECT_NEAR(step.value, 20.0, 4.0 * step.error);
  EXPECT_LT(step.error, 1e-3);
  const auto model = sim::SensorModel::parse(finding.model_toml, "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_THAT(model->effectNames(), Contains("quantisation"));
  const auto declaring = [&](const std::string& electrons) {
    write("camera.toml",
          tinyCamera("[[effect]]\ntype = 'quantisation'\nstep_electrons = " + electrons + "\n"));
    std::filesystem::remove(folder_ / "run" / plan::openedFile(plan::OpenedOf::A));
    return search(job());
  };
  const CampaignFinding right = declaring("20.0"), wrong = declaring("30.0");
  EXPECT_TRUE(right.effects.empty() && right.updates.empty()) << verdictOf(right);
  ASSERT_EQ(wrong.updates.size(), 1U) << verdictOf(wrong);
  EXPECT_NEAR(wrong.updates.front().numbers.at(0).value, 20.0, 4.0 * step.error);
  EXPECT_THAT(wrong.model_toml, HasSubstr("step_electrons = 20")) << "an update";
}

/// The file's steps of 200 electrons show in means over frames, too, which ask for finer ones: one number,
/// one update.
TEST_F(Searched, TwoNumbersOfOneDeclaredEffectAreNotBothReported) {
  simulate("[[effect]]\ntype = 'quantisation'\nstep_electrons = 20.0\n");
  write("camera.toml", tinyCamera("[[effect]]\ntype = 'quantisation'\nstep_electrons = 200.0\n"));
  CampaignJob few = job();
  few.trace.samples_per_pixel = 8;  // what is found here is the converter's, whatever the light
  const CampaignFinding finding = search(few);
  const auto steps = std::ranges::count_if(finding.updates, [](const FittedEffect& one) {
    return std::holds_alternative<sim::Quantisation>(one.effect);
  });
  ASSERT_EQ(steps, 1) << verdictOf(finding);
  EXPECT_THAT(finding.model_toml, HasSubstr("step_electrons = 20")) << "what single frames say";
}

/// What the catalogue has no name for has its form all the same.
TEST_F(Searched, StepsWithoutANameAreInTheModel) {
  const CampaignFinding finding = searchWithout("quantisation", "step_electrons = 20.0");
  ASSERT_THAT(namesOf(finding), ElementsAre("undeclared")) << verdictOf(finding);
  EXPECT_THAT(verdictOf(finding), HasSubstr("whole steps of 20 electrons"));
  EXPECT_THAT(finding.model_toml, HasSubstr("step_electrons = 20"));
}

/// An amplitude of 20 for each electron is a gain that pixels in single precision would say wrong by more than the
/// noise of them all: an effect that is nearly a gain would answer it.
TEST_F(Searched, WhateverTheAmplitudesUnitIsTheSameIsFound) {
  const auto inUnitsOf = [&](float per_electron) {
    simulate("", [=](sim::RangeImage& image, const Moment&, const CameraInfo&, std::uint64_t) {
      for (float& amplitude : image.amplitude.pixels()) amplitude *= per_electron;
    });
    std::filesystem::remove(folder_ / "run" / plan::openedFile(plan::OpenedOf::A));
    return search(job());
  };
  const Finding one = inUnitsOf(1.0F).finding, twenty = inUnitsOf(20.0F).finding;
  ASSERT_EQ(one.scores.size(), twenty.scores.size());
  // Errors of poses are in units of these, whose deviation is looked for in steps.
  const auto isOfPoses = [&](std::size_t i) {
    const auto groups = poseGroups();
    return std::ranges::find(groups, one.score_names[i], &TermGroup::name) != groups.end();
  };
  for (std::size_t i = 0; i < one.scores.size(); ++i) {
    if (isOfPoses(i)) continue;
    EXPECT_NEAR(std::sqrt(one.scores[i].statistic), std::sqrt(twenty.scores[i].statistic), 0.2)
        << one.score_names[i] << ": in units of its own noise";
  }
}

/// A camera whose amplitude is 0.3 for each electron: its steps are 6 in that unit, and 20 of the file's
/// electrons.
TEST_F(Searched, StepsAreOfTheFilesElectronsWhateverTheAmplitudesUnit) {
  simulate("[[effect]]\ntype = 'quantisation'\nstep_electrons = 20.0\n",
           [](sim::RangeImage& image, const Moment&, const CameraInfo&, std::uint64_t) {
             for (float& amplitude : image.amplitude.pixels()) amplitude *= 0.3F;
           });
  const CampaignFinding finding = search(job());
  ASSERT_THAT(namesOf(finding), ElementsAre("quantisation")) << verdictOf(finding);
  const FittedNumber step = finding.effects.front().fitted->numbers.at(0);
  EXPECT_NEAR(step.value, 20.0, 4.0 * step.error);
  EXPECT_LT(step.error, 0.2) << "as well as the unit is known: a hundredth of light at each of 30 places";
  write("camera.toml", tinyCamera("[[effect]]\ntype = 'quantisation'\nstep_electrons = 20.0\n"));
  std::filesystem::remove(folder_ / "run" / plan::openedFile(plan::OpenedOf::A));
  const CampaignFinding right = search(job());
  EXPECT_TRUE(right.effects.empty() && right.updates.empty()) << verdictOf(right);
}

}  // namespace
}  // namespace toftwin::discover
