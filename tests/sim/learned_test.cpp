// SPDX-License-Identifier: Apache-2.0
// Terms in whole cameras and images made by hand: what they add, and what is refused.
#include <gmock/gmock.h>

#include <cmath>

#include <toftwin/nan.h>

#include "sim/effects/effects.h"
#include "sim/effects/learned/covariates.h"
#include "sim/sensor/sensor_model.h"
#include "tests/sim/camera_testing.h"
#include "tests/sim/synthetic_light.h"

namespace toftwin::sim {
namespace {

using testing::HasSubstr;

Learned learnedFrom(const std::vector<std::string>& texts) {
  const Learned learned{.title = {}, .terms = LearnedTerms::parsed(texts)};
  EXPECT_EQ(learned.problem(), "");
  return learned;
}

RangeImage imageOfRanges(int width, int height, const std::function<double(int, int)>& range_m) {
  RangeImage image{.range_m = {width, height}, .amplitude = {width, height, 1000.0F}, .ambient = {width, height},
                   .flags = {width, height}, .phasors = {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image.range_m(x, y) = static_cast<float>(range_m(x, y));
  return image;
}

RangeImage applied(const Learned& learned, RangeImage image, const Moment& moment = {}, std::uint64_t frame = 0) {
  const CameraInfo camera = cameraOfSize(image.range_m.width(), image.range_m.height());
  return learned.apply(std::move(image), {moment, camera, 0, 0, {}, frame}, Random{1, frame, 3});
}

std::string problemOfTerm(const std::string& text) {
  return Learned{.title = {}, .terms = LearnedTerms::parsed({text})}.problem();
}

TEST(Learned, AddsTheSumOfItsTermsToTheRange) {
  const Learned learned = learnedFrom({"range_mm += 10 * curve(range_m, 1, 1, 2, -2, 4, 4)", "range_mm += 4 * class(column, 2, 1)"});
  const RangeImage image = applied(learned, imageOfRanges(4, 2, [](int, int y) { return y == 0 ? 1.5 : 9.0; }));
  for (int x = 0; x < 4; ++x) {
    EXPECT_NEAR(image.range_m(x, 0), 1.5 + 1e-3 * (-5.0 + (x % 2) * 4.0), 1e-6);
    EXPECT_NEAR(image.range_m(x, 1), 9.0 + 1e-3 * (40.0 + (x % 2) * 4.0), 1e-6);
  }
}

TEST(Learned, TakesTheImageAsItCame) {
  const Learned learned = learnedFrom({"range_mm += 500", "range_mm += 100 * step(range_mm, 2200)"});
  EXPECT_EQ(applied(learned, imageOfRanges(1, 1, [](int, int) { return 2.0; })).range_m[0], 2.5F);
}

TEST(Learned, ChangesTheAmplitudeByItsPercent) {
  const RangeImage image = applied(learnedFrom({"amplitude_percent += -10 * column"}), imageOfRanges(3, 1, [](int, int) { return 2.0; }));
  for (int x = 0; x < 3; ++x) EXPECT_NEAR(image.amplitude(x, 0), 1000.0 - 100.0 * x, 1e-3);
}

TEST(Learned, AddsNothingWhereAFrameDoesNotSayWhatATermGoesWith) {
  const Learned learned = learnedFrom({"range_mm += 5 * temperature_illumination_c", "range_mm += 8"});
  EXPECT_NEAR(applied(learned, imageOfRanges(1, 1, [](int, int) { return 2.0; })).range_m[0], 2.008, 1e-6);
  Moment warm;
  warm.temperatures = {{"illumination", 40.0 * celsius}};
  EXPECT_NEAR(applied(learned, imageOfRanges(1, 1, [](int, int) { return 2.0; }), warm).range_m[0], 2.208, 1e-6);
}

TEST(Learned, KnowsTheFramesNumber) {
  const Learned learned = learnedFrom({"range_mm += 26 * class(frame, 7, 0)"});
  for (std::uint64_t frame = 0; frame < 15; ++frame)
    EXPECT_NEAR(applied(learned, imageOfRanges(1, 1, [](int, int) { return 2.0; }), {}, frame).range_m[0],
                frame % 7 == 0 ? 2.026 : 2.0, 1e-6);
}

// r = x² + 3y: ½(0 − 4) across, ½(0 − 6) along at (1, 1); the mean of x² over the eight about it is 14/8, that of 3y is 3.
TEST(Learned, TakesSharesOfTheRangesAround) {
  const RangeImage before = imageOfRanges(4, 4, [](int x, int y) { return x * x + 3.0 * y; });
  const auto at = [&](const std::string& term) { return applied(learnedFrom({term}), before).range_m; };
  EXPECT_NEAR(at("range_mm += 0.1 * across()")(1, 1), 4.0 + 0.1 * -2.0, 1e-6);
  EXPECT_NEAR(at("range_mm += 0.1 * along()")(1, 1), 4.0 + 0.1 * -3.0, 1e-6);
  EXPECT_NEAR(at("range_mm += 0.1 * around()")(1, 1), 4.0 + 0.1 * (14.0 / 8.0 - 1.0), 1e-6);
  EXPECT_EQ(at("range_mm += 0.1 * around()")(0, 1), before.range_m(0, 1)) << "at the image's edge nothing is done";
}

TEST(Learned, NoiseHasTheDeviationThatItsTermsSay) {
  const RangeImage before = imageOfRanges(200, 100, [](int, int) { return 2.0; });
  const RangeImage after = applied(learnedFrom({"noise_mm += 3", "noise_mm += 0.02 * column"}), before);
  double left = 0.0, right = 0.0;
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 10; ++x) {
      left += std::pow(1e3 * (static_cast<double>(after.range_m(x, y)) - 2.0), 2.0) / 1000.0;
      right += std::pow(1e3 * (static_cast<double>(after.range_m(190 + x, y)) - 2.0), 2.0) / 1000.0;
    }
  }
  // Of 1000 numbers a standard deviation is known to 2.2 %.
  EXPECT_NEAR(std::sqrt(left), 3.09, 4.0 * 0.022 * 3.09);
  EXPECT_NEAR(std::sqrt(right), 6.89, 4.0 * 0.022 * 6.89);
}

TEST(Learned, LosesTheShareOfReadingsThatItsTermsSay) {
  const RangeImage image = applied(learnedFrom({"invalid_percent += 20"}), imageOfRanges(200, 200, [](int, int) { return 2.0; }));
  int lost = 0;
  for (std::size_t i = 0; i < image.range_m.size(); ++i) {
    const bool is_invalid = (image.flags[i] & static_cast<unsigned>(PixelFlag::Invalid)) != 0;
    EXPECT_EQ(std::isnan(image.range_m[i]), is_invalid);
    lost += is_invalid ? 1 : 0;
  }
  EXPECT_NEAR(lost, 8000, 4.0 * std::sqrt(40000.0 * 0.2 * 0.8));
}

TEST(Learned, RefusesACovariateThatTheSimulatorDoesNotKnow) {
  EXPECT_THAT(problemOfTerm("range_mm += 2 * plate_mm"),
              testing::AllOf(HasSubstr("the simulator knows no \"plate_mm\""), HasSubstr("time_s, temperature_*_c, "),
                             HasSubstr("amplitude_e")));
  EXPECT_THAT(problemOfTerm("range_mm += 2 * albedo"), HasSubstr("knows no \"albedo\" where range is made"));
  EXPECT_THAT(problemOfTerm("light_percent += 2 * amplitude_e"), HasSubstr("where light is made"));
  EXPECT_THAT(problemOfTerm("in_phase_e += 2 * range_m"), HasSubstr("where samples is made"));
  EXPECT_EQ(problemOfTerm("range_mm += 2 * temperature_laser_c"), "");
}

TEST(Learned, RefusesACategory) {
  EXPECT_THAT(problemOfTerm("range_mm += 2 * level(column, 'left')"), HasSubstr("has no level 'left'"));
}

TEST(Learned, RefusesTermsOfSeveralStages) {
  const Learned both{.title = {}, .terms = LearnedTerms::parsed({"range_mm += 2", "delay_mm += 2"})};
  EXPECT_THAT(both.problem(), HasSubstr("terms of range (\"range_mm += 2\") and of light (\"delay_mm += 2\")"));
}

TEST(Learned, RefusesAValueWithoutAUnit) {
  EXPECT_THAT(problemOfTerm("value += 2"), HasSubstr("no unit"));
}

TEST(Learned, InACameraFileSaysWhereItIsWrong) {
  const std::string effect = "[[effect]]\ntype = 'learned'\nterms = ['range_mm += 2 * wobble(row)']\n";
  EXPECT_THAT(errorOf(plainCamera(4, 2, 0.5, effect)), HasSubstr("expected one of power, "));
  EXPECT_THAT(errorOf(plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'learned'\nterms = ['range_mm += plate_mm']\n")),
              HasSubstr("expected a number"));
}

TEST(Learned, ModelsThatDifferInATermHaveDifferentIds) {
  const auto idWith = [](const std::string& term) {
    return modelOf(plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'learned'\nterms = ['" + term + "']\n")).id();
  };
  EXPECT_NE(idWith("range_mm += 2"), idWith("range_mm += 3"));
  EXPECT_EQ(idWith("range_mm += 2"), idWith("range_mm  +=  2"));
}

// A camera that demodulates keeps of the light what it correlates; the scene goes with it for whom needs it.
TEST(Learned, KnowsTheSceneInAWholeCamera) {
  const std::string effect = "[[effect]]\ntype = 'learned'\nterms = ['delay_mm += 1 * curve(incidence, 1, 0, 20, 19)']\n";
  Light light = syntheticLight(40, 25, {80_MHz}, 1, [](int, int) { return std::vector<Way>{{1.0, 1.0}}; });
  for (Vec3f& normal : light.truth.normal.pixels()) normal = {0.6F, 0.0F, -0.8F};
  const auto rangeWith = [&](const std::string& effects) {
    const SensorModel model = modelOf(plainCamera(4, 2, 0.5, effects));
    return static_cast<double>(model.expose(light, {}, 1, 0).range.range_m(20, 12));
  };
  const double incidence = incidenceAt(modelOf(plainCamera(4, 2, 0.5)).camera(), {0.6F, 0.0F, -0.8F}, 20, 12);
  EXPECT_NEAR(rangeWith(effect) - rangeWith(""), 1e-3 * (incidence - 1.0), 1e-6);
}

TEST(LearnedCovariates, EachHasANameAUnitAndSaysWhatItIs) {
  for (const LearnedCovariate& one : learnedCovariates()) {
    EXPECT_FALSE(one.name.empty() || one.meaning.empty()) << one.name;
    const int sources = (one.of_frame != nullptr) + (one.of_place != nullptr) + (one.of_light != nullptr || one.of_decoded != nullptr);
    EXPECT_EQ(sources, 1) << one.name;
    std::string name{one.name};
    if (const auto star = name.find('*'); star != std::string::npos) name.replace(star, 1, "somewhere");
    EXPECT_EQ(learnedCovariate(name), &one) << name;
  }
  EXPECT_EQ(learnedCovariate("temperature__c"), nullptr);
  EXPECT_EQ(learnedCovariate("temperature_a b_c"), nullptr);
}

}  // namespace
}  // namespace toftwin::sim
