// SPDX-License-Identifier: Apache-2.0
// Whole searches of small campaigns: what is hidden in them the finder is never told.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "calib/plan/opened.h"
#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

TEST_F(Searched, NothingIsFoundWhereNothingIsHidden) {
  simulate("");
  const CampaignFinding finding = search(job());
  EXPECT_TRUE(finding.effects.empty()) << verdictOf(finding);
  EXPECT_TRUE(finding.updates.empty()) << verdictOf(finding);
}

TEST_F(Searched, AHiddenEffectOfTheCatalogueIsNamedFittedAndAdded) {
  simulate("[[effect]]\ntype = 'vignetting'\nexponent = 0.4\n");
  compare::Progress silent{nullptr};
  const auto answer = discoverCampaign(job(), silent);
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_THAT(answer->verdict, HasSubstr("The model lacks vignetting"))
      << std::ifstream{folder_ / "out" / "report.md"}.rdbuf();
  const auto model = sim::SensorModel::load(folder_ / "out" / "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  const auto effects = model->effects();
  const auto added = std::ranges::find_if(
      effects, [](const auto& any) { return std::holds_alternative<sim::Vignetting>(any); });
  ASSERT_NE(added, effects.end());
  EXPECT_NEAR(std::get<sim::Vignetting>(*added).exponent, 0.4, 0.1);
  EXPECT_THAT(answer->ladder, testing::AllOf(HasSubstr("  raw "), HasSubstr("  constant "), HasSubstr("  effects ")));
  std::stringstream report;
  report << std::ifstream{folder_ / "out" / "report.json"}.rdbuf();
  EXPECT_THAT(report.str(), testing::AllOf(HasSubstr("\"ladder\""), HasSubstr("\"name\": \"raw\"")));
  // Opened once, and no more.
  EXPECT_TRUE(std::filesystem::exists(folder_ / "run" / plan::openedFile(plan::OpenedOf::A)));
  EXPECT_THAT(errorOf(job()), HasSubstr("the locked captures of camera A were opened on 20"));
}

TEST_F(Searched, WhatRemainsOnLockedCapturesIsLess) {
  simulate("[[effect]]\ntype = 'clock_scale'\nppm = 3000.0\n");
  const CampaignFinding finding = search(job());
  ASSERT_THAT(namesOf(finding), ElementsAre("clock_scale")) << verdictOf(finding);
  ASSERT_TRUE(finding.judgement);
  EXPECT_LT(finding.judgement->after.rms_mm, 0.8 * finding.judgement->before.rms_mm);
  EXPECT_LT(finding.judgement->before.rms_mm, finding.judgement->raw.rms_mm) << "a clock that is fast by 0.3 % is mostly an offset";
  EXPECT_GT(finding.judgement->removed, 0.75);
  const auto& numbers = finding.effects.front().fitted->numbers;
  ASSERT_EQ(numbers.size(), 1u);
  EXPECT_NEAR(numbers.front().value, 3000.0, 4.0 * numbers.front().error);
}

/// 5 mm for each e-fold of exposure, which no effect of the catalogue does.
TEST_F(Searched, AnEffectOfNoCatalogueIsCalledUndeclaredAndNamedByWhatItGoesWith) {
  simulate("", [](sim::RangeImage& image, const Moment& moment, const CameraInfo&, std::uint64_t) {
    const double folds = std::log(moment.exposures.front().duration.in(microsecond) / 500.0);
    for (float& range_m : image.range_m.pixels()) range_m += static_cast<float>(5e-3 * folds);
  });
  const CampaignFinding finding = search(job());
  ASSERT_THAT(namesOf(finding), ElementsAre("undeclared")) << verdictOf(finding);
  EXPECT_THAT(finding.effects.front().found.covariates, ElementsAre("exposure_us"));
  ASSERT_TRUE(finding.effects.front().fitted) << "not in the model";
  const auto model = sim::SensorModel::parse(finding.model_toml, "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_THAT(model->effectNames(), Contains("learned"));
}

/// A wave over the rows, in the range and in the brightness: two changes, but one place and one cause.
TEST_F(Searched, WhatMovesTheRangeAndDimsTheLightAlongOneCovariateIsOneEffect) {
  simulate("", [](sim::RangeImage& image, const Moment&, const CameraInfo&, std::uint64_t) {
    for (int y = 0; y < image.range_m.height(); ++y) {
      const auto wave = static_cast<float>(std::sin(2.0 * std::numbers::pi * y / image.range_m.height()));
      for (int x = 0; x < image.range_m.width(); ++x)
        image.range_m(x, y) += 6e-3F * wave, image.amplitude(x, y) *= 1.0F + 0.03F * wave;
    }
  });
  const CampaignFinding finding = search(job());
  ASSERT_THAT(namesOf(finding), ElementsAre("undeclared")) << verdictOf(finding);
  const Effect& effect = finding.effects.front().found;
  EXPECT_THAT(effect.covariates, ElementsAre("gain", "row")) << verdictOf(finding);
  EXPECT_EQ(effect.stage, Stage::Light) << "no error of a range changes amplitudes";
  EXPECT_TRUE(finding.effects.front().fitted) << "what it does to the range can be written";
}

/// Which is a line in ln A: not something else that it may be.
TEST_F(Searched, AFormulaThatIsTheEffectsOwnIsNoOtherAnswer) {
  simulate("[[effect]]\ntype = 'time_walk'\nper_e_fold_mm = 4.0\n");
  const CampaignFinding finding = search(job());
  ASSERT_THAT(namesOf(finding), ElementsAre("time_walk")) << verdictOf(finding);
  for (const Alternative& other : finding.effects.front().found.alternatives)
    EXPECT_TRUE(other.group.terms.empty()) << other.name;
}

TEST_F(Searched, AWrongNumberOfADeclaredEffectIsAnUpdateAndNoNewEffect) {
  simulate("[[effect]]\ntype = 'clock_scale'\nppm = 5000.0\n");
  write("camera.toml", tinyCamera("[[effect]]\ntype = 'clock_scale'\nppm = 1000.0\n"));
  const CampaignFinding finding = search(job());
  EXPECT_TRUE(finding.effects.empty()) << verdictOf(finding);
  ASSERT_EQ(finding.updates.size(), 1u) << verdictOf(finding);
  const FittedNumber& ppm = finding.updates.front().numbers.front();
  EXPECT_NEAR(ppm.value, 5000.0, 4.0 * ppm.error);
  const auto model = sim::SensorModel::parse(finding.model_toml, "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(std::ranges::count(model->effectNames(), std::string{"clock_scale"}), 1);
}

/// A file may list a charge once for each raw exposure: that it has one is no reason not to look at the
/// others.
TEST_F(Searched, AChargeInAnotherRawExposureThanTheFileSaysIsNamedByItsPlace) {
  simulate("[[effect]]\ntype = 'sample_offset'\nstep = 1\nelectrons = 400.0\n");
  write("camera.toml", tinyCamera("[[effect]]\ntype = 'sample_offset'\nstep = 2\nelectrons = 400.0\n"));
  const CampaignFinding finding = search(job());
  ASSERT_THAT(namesOf(finding), ElementsAre("sample_offset")) << verdictOf(finding);
  EXPECT_THAT(verdictOf(finding), HasSubstr("The model lacks sample_offset (step ")) << "by its place";
  ASSERT_EQ(finding.updates.size(), 1U) << verdictOf(finding);
  EXPECT_NEAR(finding.updates.front().numbers.front().value, 0.0, 20.0) << "the other one is not there";
  const auto model = sim::SensorModel::parse(finding.model_toml, "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(std::ranges::count(model->effectNames(), std::string{"sample_offset"}), 2);
  EXPECT_GT(finding.judgement->removed, 0.95);
}

/// Light from other pixels shows like nothing else. Of what is left in the catalogue a ghost image comes nearest,
/// and a charge in some raw exposures next: neither is it.
TEST_F(Searched, AnEffectThatTheCatalogueLacksIsNotBlamedOnAnother) {
  simulate("[[effect]]\ntype = 'lens_scatter'\nveil = 0.0015\nhalo = 0.002\n");
  CampaignJob without = job();
  without.left_out = {"lens_scatter"};
  const CampaignFinding finding = search(without);
  ASSERT_THAT(namesOf(finding), ElementsAre("undeclared")) << verdictOf(finding);
  EXPECT_THAT(finding.effects.front().found.covariates, ElementsAre("neighbours")) << verdictOf(finding);
  EXPECT_THAT(finding.effects.front().found.refused, testing::Not(testing::IsEmpty())) << "nothing was tried";
  // What it does is in the model nevertheless.
  const auto model = sim::SensorModel::parse(finding.model_toml, "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_THAT(model->effectNames(), Contains("learned"));
  ASSERT_TRUE(finding.judgement);
  EXPECT_GT(finding.judgement->removed, 0.7) << verdictOf(finding);
}

/// Light that goes into a surface before it comes back is the later the flatter it meets it.
TEST_F(Searched, ADelayThatGoesWithTheIncidenceIsATableOfTheLight) {
  simulate(
      "[[effect]]\ntype = 'learned'\nterms = ['delay_mm += 1 * curve(incidence, 1, 0, 1.2, 4, 1.5, 6, 2, 7)']\n");
  const CampaignFinding finding = search(job());
  ASSERT_THAT(namesOf(finding), ElementsAre("undeclared")) << verdictOf(finding);
  EXPECT_THAT(finding.effects.front().found.covariates, Contains("incidence")) << verdictOf(finding);
  const auto model = sim::SensorModel::parse(finding.model_toml, "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_THAT(model->effectNames(), Contains("learned"));
  ASSERT_TRUE(finding.judgement);
  EXPECT_GT(finding.judgement->removed, 0.7) << verdictOf(finding);
}

/// The pattern of one camera out of 2³²: not one of those that the catalogue's effect is tried with.
TEST_F(Searched, APatternOfPixelsIsNamedByWhereItIs) {
  simulate("[[effect]]\ntype = 'fixed_pattern_phase'\nsigma_rad = 0.01\ndevice = 4711\n");
  const CampaignFinding finding = search(job());
  ASSERT_THAT(namesOf(finding), ElementsAre("undeclared")) << verdictOf(finding);
  EXPECT_THAT(finding.effects.front().found.covariates, ElementsAre("pixel")) << verdictOf(finding);
  EXPECT_GT(finding.judgement->removed, 0.5);
  const auto model = sim::SensorModel::parse(finding.model_toml, "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_THAT(model->effectNames(), Contains("learned"));
}

/// Pixels of a row share wires. It is in the model: with no form nothing of it was removed.
TEST_F(Searched, LightAlongRowsIsALineOfTheKernel) {
  simulate("[[effect]]\ntype = 'learned'\nterms = ['light_percent += 1.5 * row_mean()']\n");
  const CampaignFinding finding = search(job());
  ASSERT_THAT(namesOf(finding), ElementsAre("undeclared")) << verdictOf(finding);
  EXPECT_THAT(finding.effects.front().found.covariates, ElementsAre("neighbours")) << verdictOf(finding);
  ASSERT_TRUE(finding.effects.front().fitted) << "the simulator has a form for it";
  const auto* kernel = std::get_if<sim::Learned>(&finding.effects.front().fitted->effect);
  ASSERT_NE(kernel, nullptr);
  const std::vector<terms::Term>& lines = kernel->terms.list();
  const auto& numbers = finding.effects.front().fitted->numbers;
  ASSERT_EQ(numbers.size(), lines.size());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    EXPECT_NE(lines[i].carrier, terms::Carrier::Square) << toText(lines[i]);
    EXPECT_NEAR(numbers[i].value, lines[i].carrier == terms::Carrier::Row ? 1.5 : 0.0, 4.0 * numbers[i].error) << toText(lines[i]);
  }
  ASSERT_TRUE(finding.judgement);
  EXPECT_GT(finding.judgement->removed, 0.7) << verdictOf(finding);
}

/// It is light: not a charge that happens to go with the exposure.
TEST_F(Searched, TheSameLightInAllPixelsIsStrayLight) {
  simulate("[[effect]]\ntype = 'internal_reflection'\nradiance_w_per_m2_sr = 0.003\n");
  CampaignJob without = job();
  without.left_out = {"internal_reflection"};
  const CampaignFinding finding = search(without);
  ASSERT_THAT(namesOf(finding), ElementsAre("undeclared")) << verdictOf(finding);
  EXPECT_THAT(finding.effects.front().found.covariates, ElementsAre("stray")) << verdictOf(finding);
  EXPECT_EQ(finding.effects.front().found.stage, Stage::Light);
  ASSERT_TRUE(finding.effects.front().fitted) << "the simulator has a form for it";
  const auto* form = std::get_if<sim::InternalReflection>(&finding.effects.front().fitted->effect);
  ASSERT_NE(form, nullptr);
  EXPECT_NEAR(form->radiance, 0.003, 0.0006);
  EXPECT_TRUE(finding.updates.empty());
}

/// Only a cold camera shows it, and only a few captures are of a cold camera. What else goes with the warm-up is
/// named beside it.
TEST_F(Searched, WhatOnlyTheFirstCapturesShowIsNamedWithWhatLooksAlike) {
  simulate("[[effect]]\ntype = 'residual_drift'\nper_degree_mm = 0.4\n", {}, true, 0, 2);
  const CampaignFinding finding = search(job());
  ASSERT_EQ(finding.effects.size(), 1U) << verdictOf(finding);
  std::vector<std::string> answers = namesOf(finding);
  for (const Alternative& other : finding.effects.front().found.alternatives) answers.push_back(other.name);
  EXPECT_THAT(answers, testing::IsSupersetOf({"residual_drift", "thermal_delay", "warm_up"}))
      << verdictOf(finding) << testing::PrintToString(finding.effects.front().found.refused);
  // They differ where a camera's time and its temperatures do not go together.
  ASSERT_TRUE(finding.effects.front().next);
  EXPECT_GT(finding.effects.front().next->chi2, 9.0);
  EXPECT_LT(finding.effects.front().next->taken_chi2, finding.effects.front().next->chi2);
  EXPECT_THAT(finding.effects.front().next->change,
              testing::AnyOf(HasSubstr("switching"), HasSubstr("warmer")));
}

/// A camera of square waves.
class OfSquareWaves : public Searched {
 protected:
  static std::string square(const std::string& effects) {
    std::string text = tinyCamera(effects);
    text.replace(text.find("contrast = 0.5"), 14,
                 "contrast = 0.5\nemitted = 'square'\ndemodulated = 'square'");
    text.replace(text.find("taps = 2"), 8, "taps = 2\nharmonics = 7");
    return text;
  }
  /// `exact`: the rig and the lamp are as they are said to be.
  [[nodiscard]] CampaignFinding searchFor(const std::string& hidden, const std::string& declared,
                                          bool exact = false) const {
    write("camera.toml", square(declared));
    const auto plan = plan::parsePlan(smallPlan(), "plan.toml");
    const auto camera = sim::SensorModel::parse(square(hidden), "camera.toml");
    const auto scene = sim::Scene::parse(smallScene(), "scene.toml");
    if (!plan || !camera || !scene) throw std::runtime_error("the small campaign's files are wrong");
    SimulatedRun run{.plan = *plan, .camera = *camera, .scene = *scene};
    if (exact) run.pose_error_m = run.pose_error_deg = run.light_error = 0.0;
    discover::write(run, folder_ / "run");
    return search(job());
  }
};

/// With square waves a delay of the light moves the cyclic error, which no offset does: locked captures are
/// judged with it, and without it before; model.toml has it.
TEST_F(OfSquareWaves, ADelayOfTheLightIsInTheModelThatIsJudged) {
  const CampaignFinding finding = searchFor("[[effect]]\ntype = 'frequency_offset'\nfirst_rad = 0.04\n", "");
  EXPECT_THAT(namesOf(finding), testing::IsEmpty()) << verdictOf(finding);
  ASSERT_TRUE(finding.judgement);
  EXPECT_LT(finding.judgement->after.per_row, 1.2);
  EXPECT_GT(finding.judgement->before.per_row, 2.0 * finding.judgement->after.per_row);
  // That is the delay's merit, and said to be.
  EXPECT_GT(finding.judgement->removed_by_zero, 0.9);
  EXPECT_NEAR(finding.judgement->after.per_row, finding.judgement->with_zero.per_row, 0.1);
  EXPECT_THAT(verdictOf(finding), HasSubstr("delay of the light"));
  const auto model = sim::SensorModel::parse(finding.model_toml, "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  double found_rad = 0.0;
  for (const sim::AnyEffect& effect : model->effects())
    if (const auto* offset = std::get_if<sim::FrequencyOffset>(&effect)) found_rad = offset->first.in(radian);
  EXPECT_NEAR(found_rad, 0.04, 0.01);
}

/// A list of effects has one more where the light is late, so that an update has another place in it. The second round,
/// which started from the first one's delay, fitted what was behind it in its stead, and here nothing was.
TEST_F(OfSquareWaves, AWrongNumberIsTheSameEffectsInEachRound) {
  const auto walk = [](double per_e_fold_mm) {
    return fmt::format("[[effect]]\ntype = 'time_walk'\nper_e_fold_mm = {}\nreference_electrons = 8000.0\n",
                       per_e_fold_mm);
  };
  const CampaignFinding finding = searchFor(walk(2.0), walk(1.5), true);
  ASSERT_EQ(finding.updates.size(), 1U) << verdictOf(finding);
  EXPECT_EQ(nameOf(finding.updates.front().effect), "time_walk");
  const FittedNumber& found = finding.updates.front().numbers.front();
  EXPECT_EQ(found.key, "per_e_fold_mm");
  EXPECT_NEAR(found.value, 2.0, 4.0 * found.error);
  // What nothing tells stays as the file says it: another one is an offset of the range.
  EXPECT_EQ(std::get<sim::TimeWalk>(finding.updates.front().effect).reference_electrons, 8000.0);
}

/// Before it is found, a wrong time_walk is a range error of several millimetres, and the poses go after it. What a
/// camera of square waves reads of a millimetre is another one by a third: taken for one, the poses' way back left a
/// delay of the light and effects that are none.
TEST_F(OfSquareWaves, AWrongNumberThatLooksLikePosesIsThatAlone) {
  const auto walk = [](double per_e_fold_mm) {
    return fmt::format("[[effect]]\ntype = 'time_walk'\nper_e_fold_mm = {}\n", per_e_fold_mm);
  };
  const CampaignFinding finding = searchFor(walk(6.0), walk(1.5));
  EXPECT_THAT(namesOf(finding), testing::IsEmpty()) << verdictOf(finding);
  EXPECT_EQ(finding.zero.delay_mm, 0.0);
  ASSERT_EQ(finding.updates.size(), 1U) << verdictOf(finding);
  const FittedNumber& found = finding.updates.front().numbers.front();
  EXPECT_NEAR(found.value, 6.0, 4.0 * found.error);
}

/// A radian is 795.8 mm. The two say nearly the same of the range, so that it is their sum that the poses
/// know: 30 of them, each 1 mm off, to 0.2 mm.
TEST_F(OfSquareWaves, WhereZeroLiesIsAddedOnceToWhatTheFileSaysOfIt) {
  const auto zero = [](double delay_mm, double offset_rad) {
    return fmt::format(
        "[[effect]]\ntype = 'frequency_offset'\nfirst_rad = {}\n[[effect]]\ntype = 'delay'\noffset_mm = {}\n",
        offset_rad, delay_mm);
  };
  const CampaignFinding finding = searchFor(zero(30.0, 0.05), zero(10.0, 0.01));
  EXPECT_THAT(namesOf(finding), testing::IsEmpty()) << verdictOf(finding);
  const auto model = sim::SensorModel::parse(finding.model_toml, "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  std::vector<double> delays_mm, offsets_rad;
  for (const sim::AnyEffect& effect : model->effects()) {
    if (const auto* delay = std::get_if<sim::Delay>(&effect))
      delays_mm.push_back(delay->offset.in(millimetre));
    if (const auto* offset = std::get_if<sim::FrequencyOffset>(&effect))
      offsets_rad.push_back(offset->first.in(radian));
  }
  ASSERT_EQ(delays_mm.size(), 1U);
  ASSERT_EQ(offsets_rad.size(), 1U);
  EXPECT_NEAR(offsets_rad.front(), 0.05, 0.01);
  EXPECT_NEAR(delays_mm.front() + 795.8 * offsets_rad.front(), 30.0 + 795.8 * 0.05, 1.5);
}

/// Waves of the error as long as a capture's ranges are wide look like a place of their own for each capture:
/// poses of 1 mm went 16 mm off to hold them, and a delay with them.
TEST_F(OfSquareWaves, AStrongWaveIsNotTakenForPosesThatAreOff) {
  const CampaignFinding finding = searchFor("[[effect]]\ntype = 'harmonics'\nthird = 0.05\n", "");
  EXPECT_THAT(namesOf(finding), testing::ElementsAre("harmonics")) << verdictOf(finding);
  EXPECT_LT(finding.finding.scales.front(), 2.0) << "poses are off by one unit";
  EXPECT_LT(std::abs(finding.zero.delay_mm), 3.0);
  ASSERT_TRUE(finding.judgement);
  EXPECT_LT(finding.judgement->after.per_row, 1.2);
  EXPECT_GT(finding.judgement->before.per_row, 10.0);
  ASSERT_TRUE(finding.effects.front().fitted);
  const auto& numbers = finding.effects.front().fitted->numbers;
  const auto third = std::ranges::find(numbers, "third", &FittedNumber::key);
  ASSERT_NE(third, numbers.end());
  EXPECT_NEAR(third->value, 0.05, 4.0 * third->error);
}

/// A gain that goes with the range, and one along the columns that changes far less: neither takes anything
/// from the other, so that the weaker is no rest of the stronger.
TEST_F(Searched, AFaintSecondCauseIsAnEffectOfItsOwn) {
  simulate("", [](sim::RangeImage& image, const Moment&, const CameraInfo&, std::uint64_t) {
    for (int y = 0; y < image.range_m.height(); ++y) {
      for (int x = 0; x < image.range_m.width(); ++x) {
        const auto by = static_cast<float>(x) / static_cast<float>(image.range_m.width());
        const float range_m = image.range_m(x, y);
        image.amplitude(x, y) *= 1.0F + 0.03F * std::sin(4.0F * range_m) + 0.025F * by * by;
      }
    }
  });
  const CampaignFinding finding = search(job());
  ASSERT_FALSE(finding.effects.empty()) << verdictOf(finding);
  EXPECT_EQ(finding.effects.size(), 2U) << verdictOf(finding);
  for (const FoundEffect& one : finding.effects) EXPECT_FALSE(one.found.is_rest) << verdictOf(finding);
}

/// A gain that goes with the range, and a weaker one with the distance from the middle of the image, where a
/// wall is farther away, too: the weaker one's curve is in part the stronger one's.
TEST_F(Searched, AFaintSecondEffectThatSharesAPartWithAStrongOneIsItsRest) {
  simulate("", [](sim::RangeImage& image, const Moment&, const CameraInfo& camera, std::uint64_t) {
    for (int y = 0; y < image.range_m.height(); ++y) {
      for (int x = 0; x < image.range_m.width(); ++x) {
        const double range_m = static_cast<double>(image.range_m(x, y));
        const double radius = std::hypot(x - camera.cx, y - camera.cy) / camera.width;
        image.amplitude(x, y) *= static_cast<float>(1.0 + 0.02 * range_m * range_m + 0.02 * radius);
      }
    }
  });
  const CampaignFinding finding = search(job());
  ASSERT_EQ(finding.effects.size(), 2U) << verdictOf(finding);
  EXPECT_THAT(finding.effects[0].found.covariates, ElementsAre("gain", "range_m"));
  EXPECT_FALSE(finding.effects[0].found.is_rest) << verdictOf(finding);
  EXPECT_THAT(finding.effects[1].found.covariates, ElementsAre("gain", "radius_px"));
  EXPECT_TRUE(finding.effects[1].found.is_rest) << verdictOf(finding);
}

/// A table with a knob for each half metre can look like a scale, too.
TEST_F(Searched, AFormulaIsNotCalledATable) {
  simulate("[[effect]]\ntype = 'clock_scale'\nppm = 3000.0\n");
  CampaignJob without = job();
  without.left_out = {"clock_scale"};
  const CampaignFinding finding = search(without);
  ASSERT_THAT(namesOf(finding), ElementsAre("undeclared")) << verdictOf(finding);
  EXPECT_THAT(finding.effects.front().found.covariates, ElementsAre("range_m")) << verdictOf(finding);
}

/// Half of the light in a corner has been at both boards; traced with few paths it is noisy, and filters that
/// smooth noise must not seem to explain anything, nor must pixels of rare paths count less.
TEST_F(Searched, WhatTracingHasByChanceIsNoEffectOfTheCamera) {
  write("scene.toml", cornerScene());
  write("camera.toml", smallCamera());
  const auto plan = plan::parsePlan(cornerPlan(), "plan.toml");
  const auto camera = sim::SensorModel::parse(smallCamera(), "camera.toml");
  const auto scene = sim::Scene::parse(cornerScene(), "scene.toml");
  ASSERT_TRUE(plan && camera && scene);
  discover::write({.plan = *plan, .camera = *camera, .scene = *scene, .max_surfaces = 3}, folder_ / "run");
  CampaignJob noisy = job();
  noisy.trace.max_surfaces = 3, noisy.trace.samples_per_pixel = 24;
  const CampaignFinding finding = search(noisy);
  EXPECT_THAT(namesOf(finding), testing::IsEmpty()) << verdictOf(finding);
  EXPECT_GT(finding.finding.first_p, 0.01);
}

/// The other way round at the places that are only locked: what was learned makes it worse there.
TEST_F(Searched, WhatDoesWorseOnLockedCapturesIsNotWritten) {
  simulate("", [](sim::RangeImage& image, const Moment& moment, const CameraInfo&, std::uint64_t) {
    const double z = moment.world_from_camera->translation_m.z;  // the wall is at 2 m
    const bool is_only_locked = std::abs(z - std::round(z)) < 1e-6;
    for (float& range_m : image.range_m.pixels()) range_m *= is_only_locked ? 0.99F : 1.005F;
  });
  const CampaignFinding finding = search(job());
  ASSERT_FALSE(finding.effects.empty());
  ASSERT_TRUE(finding.judgement);
  EXPECT_TRUE(finding.is_worse) << verdictOf(finding);
  EXPECT_THAT(verdictOf(finding), HasSubstr("it is not in model.toml"));
  const auto model = sim::SensorModel::parse(finding.model_toml, "model.toml");
  const auto declared = sim::SensorModel::parse(tinyCamera(), "camera.toml");
  ASSERT_TRUE(model && declared);
  EXPECT_EQ(model->effectNames(), declared->effectNames());
}

/// So faint that it does not stand out of the noise of all pixels, and larger cells show nothing of it: a 24th of what
/// is gained, ± 4, which is as good as nothing.
TEST_F(Searched, AFaintPatternOfPixelsIsBetterOnLockedCaptures) {
  const CampaignFinding finding = searchWithout("fixed_pattern_phase", "sigma_rad = 0.0005\ndevice = 4711");
  ASSERT_EQ(finding.effects.size(), 1U) << verdictOf(finding);
  ASSERT_TRUE(finding.judgement);
  EXPECT_GT(finding.judgement->gained, 50.0);
  EXPECT_GE(finding.judgement->cells, 384);
  EXPECT_FALSE(finding.is_worse);
  EXPECT_THAT(finding.notes, testing::Contains(HasSubstr("each pixel tells its own value alone")));
}

TEST_F(Searched, SaysWhatIsMissingOrWrong) {
  CampaignJob other = job();
  EXPECT_THAT(errorOf(other), HasSubstr("the folder of a run of `toftwin measure`?"));
  other.scene = folder_ / "nowhere.toml";
  EXPECT_THAT(errorOf(other), HasSubstr("nowhere.toml"));
  other = job();
  other.model = (folder_ / "no.toml").string();
  EXPECT_THAT(errorOf(other), HasSubstr("--model takes a camera file or one of the presets"));
  write("camera.toml", tinyCamera("[[effect]]\ntype = 'clock_scale'\nppmm = 1\n"));
  EXPECT_THAT(errorOf(job()), HasSubstr("ppmm"));
}

TEST_F(Searched, SaysWhyARunCannotBeSearched) {
  simulate("", {}, false, 2);
  EXPECT_THAT(errorOf(job()), HasSubstr("give poses in the plan"));
  simulate("", {}, true, 1);
  EXPECT_THAT(errorOf(job()), HasSubstr("without repeats nothing is known of the noise"));
  simulate("", {}, true, 2);
  std::string small = tinyCamera();
  small.replace(small.find("width = 28"), 10, "width = 24");
  write("camera.toml", small);
  EXPECT_THAT(errorOf(job()),
              HasSubstr("the run's images have 28 x 21 pixels, the camera file's camera has 24 x 21"));
  write("camera.toml", tinyCamera());
  CampaignJob with_block = job();
  with_block.scene_of_block["corner"] = folder_ / "scene.toml";
  EXPECT_THAT(errorOf(with_block), HasSubstr("the run has no such block; there are: warm-up"));
}

TEST_F(Searched, ADamagedCaptureIsAnErrorThatNamesIt) {
  simulate("", {}, true, 2);
  write("run/captures/0003-a.mcap", "damaged");
  EXPECT_THAT(errorOf(job()), HasSubstr("capture 3 (\"warm-up: 1.5 m\")"));
}

}  // namespace
}  // namespace toftwin::discover
