// SPDX-License-Identifier: Apache-2.0
// Raw exposures as a second witness: what they say of single frames, and of whole searches.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "calib/discover/campaign/captures/raw_exposures.h"
#include "sim/images/box_mean.h"
#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::UnorderedElementsAre;

constexpr double kTurn = 2.0 * std::numbers::pi;

/// One pixel: samples of `steps` for each frequency, as a function of the step's angle.
template <class Sample>
Frame frameOf(const std::vector<double>& mhz, int steps, Sample&& sample) {
  Frame frame;
  std::vector<float> values;
  for (std::size_t f = 0; f < mhz.size(); ++f) {
    for (int k = 0; k < steps; ++k) {
      values.push_back(static_cast<float>(sample(f, kTurn * k / steps)));
      frame.moment.exposures.push_back({{}, {}, mhz[f] * 1_MHz});
    }
  }
  const auto channels = static_cast<int>(values.size());
  frame.planes.push_back({PlaneKind::Samples, ElementType::F32, 1, 1, channels, Buffer::adopt(std::move(values))});
  return frame;
}

/// Light that came back late by a share of a turn, of amplitude 200.
double waveOf(double late, double angle) { return 200.0 * std::cos(angle - kTurn * late); }

TEST(RawExposures, SayTheRangeToAPeriodOfTheHighestFrequency) {
  for (const int steps : {3, 4, 5}) {
    const auto frame = frameOf({16.0, 80.0}, steps, [](std::size_t f, double angle) {
      return waveOf(f == 0 ? 0.06 : 0.3, angle);
    });
    const auto raw = rawReadingOf(frame);
    ASSERT_TRUE(raw);
    EXPECT_NEAR(raw->period_m, 299792458.0 / 160e6, 1e-9) << steps;
    EXPECT_NEAR(static_cast<double>(raw->range_m[0]), 0.3 * raw->period_m, 1e-6) << steps;
    ASSERT_EQ(raw->closures.size(), 2u * static_cast<std::size_t>(steps - 2)) << steps;
    for (const Image<float>& closure : raw->closures) EXPECT_NEAR(closure[0], 0.0F, 1e-6F) << steps;
  }
}

/// Every pattern of the samples that is no wave is in one closure or another, with its whole energy.
TEST(RawExposures, ClosuresAreWhatNoWaveMakes) {
  for (const int steps : {3, 4, 5, 8}) {
    for (int odd = 0; odd < steps; ++odd) {
      const auto frame = frameOf({30.0}, steps, [&](std::size_t, double angle) {
        return waveOf(0.2, angle) + (std::lround(angle / kTurn * steps) == odd ? 10.0 : 0.0);
      });
      const auto raw = rawReadingOf(frame);
      ASSERT_TRUE(raw);
      // Σ|s|² of one odd sample is 100: 2/K of it a wave, 1/K the mean, 1/K the alternating part, 2/K each the others.
      double squares = 0.0;
      const double size =
          std::abs(std::polar(200.0, -kTurn * 0.2) + 2.0 / steps * std::polar(10.0, -kTurn * odd / steps));
      for (std::size_t part = 0; part < raw->closures.size(); ++part) {
        const double closure = static_cast<double>(raw->closures[part][0]) * size;
        const bool is_alone = part == 0 || (steps % 2 == 0 && part + 1 == raw->closures.size());
        squares += (is_alone ? 1.0 : 0.5) * steps * closure * closure;
      }
      EXPECT_NEAR(squares, 100.0 * (1.0 - 2.0 / steps), 0.05) << steps << " steps, " << odd;
    }
  }
}

TEST(RawExposures, AreUnknownWithoutTheirFrequencies) {
  auto frame = frameOf({30.0}, 4, [](std::size_t, double angle) { return waveOf(0.2, angle); });
  ASSERT_TRUE(rawReadingOf(frame));
  Frame without = frame;
  without.moment.exposures.clear();
  EXPECT_FALSE(rawReadingOf(without));
  Frame fewer = frame;
  fewer.moment.exposures.pop_back();
  EXPECT_FALSE(rawReadingOf(fewer)) << "which samples are of which exposure is not known";
  Frame pulsed = frame;
  for (Exposure& exposure : pulsed.moment.exposures) exposure.modulation = 0_MHz;
  EXPECT_FALSE(rawReadingOf(pulsed));
  EXPECT_FALSE(rawReadingOf(Frame{}));
}

TEST(RawExposures, ARangeIsToldToAPeriod) {
  EXPECT_FLOAT_EQ(nearestRange(0.1F, 4.9F, 5.0), 5.1F);
  EXPECT_NEAR(nearestRange(4.9F, 0.0F, 5.0), -0.1F, 1e-6F);
  EXPECT_FLOAT_EQ(nearestRange(2.0F, 2.1F, 5.0), 2.0F);
}

class WithRawExposures : public Searched {
 protected:
  WithRawExposures() { with_samples_ = true; }

  /// For one effect, in data with `name` in them, which the catalogue lacks.
  [[nodiscard]] CampaignFinding searchWithout(const std::string& name, const std::string& keys) const {
    simulate("[[effect]]\ntype = '" + name + "'\n" + keys + "\n");
    CampaignJob without = job();
    without.left_out = {name}, without.finder.most_effects = 1;
    return search(without);
  }

  /// The only effect that was found, if it is one without a name that raw exposures speak of.
  static const FoundEffect* unnamedIn(const CampaignFinding& finding) {
    const bool is_one = finding.effects.size() == 1 && !finding.effects.front().found.is_catalogue;
    return is_one && finding.effects.front().raw ? &finding.effects.front() : nullptr;
  }
};

/// Three standard errors: a false alarm in 0.3 %.
TEST_F(WithRawExposures, AnErrorOfTheDecodedRangeIsNotInTheirPhase) {
  simulate("", [](sim::RangeImage& image, const Moment& moment, const CameraInfo&, std::uint64_t) {
    const double folds = std::log(moment.exposures.front().duration.in(microsecond) / 500.0);
    for (float& range_m : image.range_m.pixels()) range_m += static_cast<float>(5e-3 * folds);
  });
  const CampaignFinding finding = search(job());
  const FoundEffect* one = unnamedIn(finding);
  ASSERT_NE(one, nullptr) << verdictOf(finding);
  ASSERT_TRUE(one->raw->share);
  EXPECT_NEAR(one->raw->share->mean, 0.0, 3.0 * one->raw->share->error);
  EXPECT_LT(one->raw->share->error, 0.2);
  EXPECT_EQ(one->found.stage, Stage::Range);
  EXPECT_THAT(one->found.stages_alike, IsEmpty());
  EXPECT_FALSE(one->raw->contradicts()) << one->raw->contradiction;
}

TEST_F(WithRawExposures, ADelayBeforeDecodingIsInTheirPhase) {
  simulate("[[effect]]\ntype = 'thermal_delay'\nper_degree_mm = 0.6\n");
  CampaignJob without = job();
  without.left_out = {"thermal_delay", "warm_up", "residual_drift", "rise_drift", "duty_drift"};
  const CampaignFinding finding = search(without);
  const FoundEffect* one = unnamedIn(finding);
  ASSERT_NE(one, nullptr) << verdictOf(finding);
  ASSERT_TRUE(one->raw->share);
  EXPECT_NEAR(one->raw->share->mean, 1.0, 3.0 * one->raw->share->error);
  EXPECT_EQ(one->found.stage, Stage::Light);
  EXPECT_THAT(one->found.stages_alike, Not(Contains(Stage::Range)));
  EXPECT_FALSE(one->raw->contradicts()) << one->raw->contradiction;
}

/// A camera's own filter changes amplitudes as well as ranges.
TEST_F(WithRawExposures, AFilterOfTheDecodedImageMayBeBehindDecoding) {
  simulate("", [](sim::RangeImage& image, const Moment&, const CameraInfo&, std::uint64_t) {
    image.range_m = sim::boxMean(image.range_m, 3), image.amplitude = sim::boxMean(image.amplitude, 3);
  });
  const CampaignFinding finding = search(job());
  ASSERT_FALSE(finding.effects.empty()) << verdictOf(finding);
  const Effect& effect = finding.effects.front().found;
  std::vector<Stage> stages = effect.stages_alike;
  stages.push_back(effect.stage.value_or(Stage::Samples));
  EXPECT_THAT(stages, Contains(Stage::Range)) << verdictOf(finding);
}

TEST_F(WithRawExposures, OneRawExposureThatIsAmplifiedMoreContradictsTheOthers) {
  const CampaignFinding finding = searchWithout("sample_gain", "step = 1\ngain = 0.04");
  ASSERT_EQ(finding.effects.size(), 1u) << verdictOf(finding);
  const FoundEffect& one = finding.effects.front();
  ASSERT_TRUE(one.raw) << verdictOf(finding);
  EXPECT_TRUE(one.raw->contradicts()) << one.raw->contradiction;
  EXPECT_EQ(one.found.stage, Stage::Samples) << verdictOf(finding);
}

/// A gain of the amplitude, to ranges and amplitudes; but samples bend it, not light.
TEST_F(WithRawExposures, WhatBendsSamplesContradictsEvenWhereTheRangeStays) {
  const CampaignFinding finding = searchWithout("nonlinearity", "cubic_per_electron2 = 1e-12");
  ASSERT_EQ(finding.effects.size(), 1u) << verdictOf(finding);
  EXPECT_EQ(finding.effects.front().found.stage, Stage::Samples) << verdictOf(finding);
}

/// One warm-up: ranges alone do not tell a delay of the light from an error of the ranges.
TEST_F(WithRawExposures, OfSeveralNamesThoseGoThatTheyContradict) {
  const std::string light = "[[effect]]\ntype = 'thermal_delay'\nper_degree_mm = 0.6\n";
  simulate(light);
  const auto namesIn = [](const CampaignFinding& finding) {
    std::vector<std::string> names;
    for (const FoundEffect& one : finding.effects) {
      names.push_back(one.found.name);
      for (const Alternative& other : one.found.alternatives) names.push_back(other.name);
    }
    return names;
  };
  const auto with = namesIn(search(job()));
  EXPECT_THAT(with, Contains("thermal_delay"));
  EXPECT_THAT(with, Not(Contains("warm_up"))) << "which acts on ranges";
}

/// Both names that are left in the catalogue are errors of the range.
TEST_F(WithRawExposures, ANameThatActsElsewhereIsTakenBack) {
  simulate("[[effect]]\ntype = 'thermal_delay'\nper_degree_mm = 0.6\n");
  CampaignJob without = job();
  without.left_out = {"thermal_delay", "rise_drift", "duty_drift"};
  const CampaignFinding finding = search(without);
  ASSERT_EQ(finding.effects.size(), 1u) << verdictOf(finding);
  const Effect& effect = finding.effects.front().found;
  EXPECT_FALSE(effect.is_catalogue) << verdictOf(finding);
  EXPECT_EQ(effect.stage, Stage::Light);
  EXPECT_THAT(effect.refused, Contains(HasSubstr("the raw exposures say that it acts elsewhere")));
  for (const Alternative& other : effect.alternatives) EXPECT_FALSE(other.named) << other.name;
  EXPECT_TRUE(finding.effects.front().fitted) << "what it is fitted by stays in the model";
}

/// What the phase shows of the effect, and whether it comes about before decoding.
TEST(RawSays, OnlyWhatIsNearToAllOrNothingAndFarFromTheOther) {
  const auto says = [](double share, double error) { return RawSays{Difference{share, error}}.isBeforeDecoding(); };
  EXPECT_EQ(says(0.98, 0.05), true);
  EXPECT_EQ(says(0.04, 0.05), false);
  EXPECT_EQ(says(0.71, 0.15), true);
  EXPECT_EQ(says(0.6, 0.25), std::nullopt) << "not far enough from nothing";
  EXPECT_EQ(says(0.475, 0.06), std::nullopt) << "surely a part: the form is not what acts";
  EXPECT_EQ(says(-0.6, 0.1), std::nullopt);
  EXPECT_EQ(says(0.42, 0.186), std::nullopt) << "a halo in the light: 3.1 errors from 1, 2.3 from 0";
  EXPECT_EQ(RawSays{}.isBeforeDecoding(), std::nullopt);
}

/// Ranges alone do not tell an error of theirs from a delay.
TEST_F(Searched, WithoutRawExposuresAnErrorOfTheRangeMayActAnywhere) {
  simulate("", [](sim::RangeImage& image, const Moment& moment, const CameraInfo&, std::uint64_t) {
    const double folds = std::log(moment.exposures.front().duration.in(microsecond) / 500.0);
    for (float& range_m : image.range_m.pixels()) range_m += static_cast<float>(5e-3 * folds);
  });
  const CampaignFinding finding = search(job());
  ASSERT_EQ(finding.effects.size(), 1u) << verdictOf(finding);
  EXPECT_EQ(finding.effects.front().found.stage, Stage::Range);
  EXPECT_THAT(finding.effects.front().found.stages_alike, UnorderedElementsAre(Stage::Light, Stage::Samples));
}

TEST_F(Searched, WithoutRawExposuresNothingIsSaidOfThem) {
  simulate("[[effect]]\ntype = 'thermal_delay'\nper_degree_mm = 0.6\n");
  const CampaignFinding finding = search(job());
  ASSERT_EQ(finding.effects.size(), 1u);
  EXPECT_FALSE(finding.effects.front().raw);
  EXPECT_FALSE(finding.effects.front().found.alternatives.empty()) << verdictOf(finding);
  EXPECT_THAT(finding.notes, Contains(HasSubstr("--planes samples")));
}

}  // namespace
}  // namespace toftwin::discover
