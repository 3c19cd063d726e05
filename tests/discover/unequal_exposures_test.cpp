// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/unequal_exposures.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/Dense>

#include "calib/discover/campaign/search/model_file.h"
#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(UnequalExposures, NeedThreeStepsAndTwoTaps) {
  EXPECT_THAT(unequalExposures(2, 2), IsEmpty());
  EXPECT_THAT(unequalExposures(4, 1), IsEmpty());
  EXPECT_THAT(unequalGroups({}), IsEmpty());
  const auto secondOf = [](int steps) {
    return std::get<sim::SampleGain>(unequalExposures(steps, 2).back().second.front()).step;
  };
  EXPECT_EQ(secondOf(3), 1);
  EXPECT_EQ(secondOf(4), 1);
  EXPECT_EQ(secondOf(8), 2);
}

/// The phasor z = Σ (A₀ₖ − A₁ₖ) e^(iθₖ) of taps A = B ± a cos(φ − θₖ), as samples are correlated, and how it changes
/// with each effect by itself. Which sign φ has does not matter.
class Spanned {
 public:
  explicit Spanned(int steps) : steps_(steps) {}

  [[nodiscard]] Eigen::VectorXd changeBy(const sim::AnyEffect& effect) const {
    Eigen::VectorXd change(2 * kPhases * kAmbients);
    Eigen::Index row = 0;
    for (int p = 0; p < kPhases; ++p) {
      for (int b = 0; b < kAmbients; ++b) {
        const double phase = 2.0 * std::numbers::pi * p / kPhases, unmodulated = 1.0 + b;
        const auto z = phasor(phase, unmodulated, nullptr), with = phasor(phase, unmodulated, &effect);
        const std::complex<double> by = (with - z) / z;
        change[row++] = by.real(), change[row++] = by.imag();
      }
    }
    return change;
  }
  /// Of the change by an effect, the share that neither the carriers nor a gain and a delay of all light make.
  [[nodiscard]] double left(const sim::AnyEffect& effect) const {
    const auto carriers = unequalExposures(steps_, 2);
    Eigen::MatrixXd columns(2 * kPhases * kAmbients, 2 + static_cast<Eigen::Index>(carriers.size()));
    for (Eigen::Index row = 0; row < columns.rows(); ++row)
      columns(row, 0) = row % 2 == 0 ? 1.0 : 0.0, columns(row, 1) = row % 2 == 0 ? 0.0 : 1.0;
    for (std::size_t c = 0; c < carriers.size(); ++c) {
      Eigen::VectorXd sum = Eigen::VectorXd::Zero(columns.rows());
      for (const sim::AnyEffect& unit : carriers[c].second) sum += changeBy(unit);
      columns.col(2 + static_cast<Eigen::Index>(c)) = sum;
    }
    const Eigen::VectorXd change = changeBy(effect);
    return (change - columns * columns.colPivHouseholderQr().solve(change)).norm() / change.norm();
  }

 private:
  static constexpr int kPhases = 24, kAmbients = 3;
  [[nodiscard]] std::complex<double> phasor(double phase, double unmodulated, const sim::AnyEffect* effect) const {
    std::complex<double> z;
    for (int k = 0; k < steps_; ++k) {
      const double theta = 2.0 * std::numbers::pi * k / steps_;
      double late = 0.0;
      std::array gain{1.0, 1.0};
      if (effect != nullptr) {
        const auto* phase_error = std::get_if<sim::StepPhase>(effect);
        const auto* of_tap = std::get_if<sim::SampleGain>(effect);
        if (phase_error != nullptr && phase_error->step == k) late = phase_error->error.in(radian);
        if (of_tap != nullptr && of_tap->step == k) gain[static_cast<std::size_t>(of_tap->tap)] += of_tap->gain;
      }
      const double modulated = 0.5 * std::cos(phase - theta - late);
      z += (gain[0] * (unmodulated + modulated) - gain[1] * (unmodulated - modulated)) * std::polar(1.0, theta);
    }
    return z;
  }
  int steps_;
};

/// A thousandth: the square of the smallest errors that are told is less.
TEST(UnequalExposures, SpanThoseOfEveryRawExposureAndTap) {
  for (const int steps : {3, 4, 6, 8}) {
    const Spanned spanned{steps};
    for (int k = 0; k < steps; ++k) {
      EXPECT_LT(spanned.left(sim::StepPhase{.step = k, .error = 1e-4 * radian}), 1e-3) << steps << " " << k;
      for (const int tap : {0, 1})
        EXPECT_LT(spanned.left(sim::SampleGain{.step = k, .tap = tap, .gain = 1e-4}), 1e-3) << steps << " " << k;
    }
  }
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
  const CampaignFinding finding = searchWithout("sample_gain", "step = 2\ntap = 1\ngain = 0.01");
  ASSERT_EQ(finding.effects.size(), 1U) << verdictOf(finding);
  const Effect& found = finding.effects.front().found;
  EXPECT_THAT(found.covariates, ElementsAre("amplified", "unequal"));
  EXPECT_EQ(found.stage, Stage::Samples);
  EXPECT_THAT(found.stages_alike, IsEmpty());
  const auto model = sim::SensorModel::parse(finding.model_toml, "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  ASSERT_TRUE(finding.judgement);
  EXPECT_GT(finding.judgement->removed, 0.9) << verdictOf(finding);
  // The second tap's gain of the third raw exposure is none of its forms, which make the same by others.
  EXPECT_EQ(finding.effects.front().more.size(), 3U);
}

/// Its raw exposures contradict each other, as those of light that is another in each would.
TEST_F(Searched, ALateRawExposureWithoutANameIsUnequalAndMayBeOfTheLight) {
  with_samples_ = true;
  const CampaignFinding finding = searchWithout("step_phase", "step = 1\nerror_rad = 0.02");
  ASSERT_EQ(finding.effects.size(), 1U) << verdictOf(finding);
  const Effect& found = finding.effects.front().found;
  EXPECT_THAT(found.covariates, ElementsAre("unequal"));
  ASSERT_TRUE(finding.effects.front().raw);
  EXPECT_TRUE(finding.effects.front().raw->contradicts());
  EXPECT_EQ(found.stage, Stage::Light);
  EXPECT_THAT(found.stages_alike, ElementsAre(Stage::Samples));
  ASSERT_TRUE(finding.judgement);
  EXPECT_GT(finding.judgement->removed, 0.9) << verdictOf(finding);
}

}  // namespace
}  // namespace toftwin::discover
