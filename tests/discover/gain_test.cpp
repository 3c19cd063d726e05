// SPDX-License-Identifier: Apache-2.0
// A gain beside what goes with the reference: whose the straight part is must not be told as if it were known.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include <fmt/format.h>

#include "calib/discover/curve.h"
#include "discovered.h"

namespace toftwin::discover {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr int kRailRows = 360;

/// Distances in random order, with an error of `at` and 2 mm of noise.
template <typename Error>
std::string railOf(const Error& at, unsigned seed, double noise_mm = 2.0) {
  std::mt19937 random{seed};
  std::uniform_real_distribution<double> place{500.0, 6900.0};
  std::normal_distribution<double> normal;
  std::string text = "reference_mm,measured_mm\n";
  for (int i = 0; i < kRailRows; ++i) {
    const double reference = place(random);
    text += fmt::format("{:.3f},{:.3f}\n", reference, reference + 12.0 + at(reference) + noise_mm * normal(random));
  }
  return text;
}

/// Two harmonics of 20 MHz, which nobody told.
double cyclic(double distance) {
  const double phase = 4.0 * std::numbers::pi * distance / 7494.8;
  return 6.0 * std::sin(phase + 0.7) + 3.0 * std::sin(2.0 * phase - 0.4);
}

/// The gain was −0.0023 ± 0.0002 instead of 0, the span 20 mm instead of 14, and one place in ten within two errors.
TEST(Gain, IsNotFittedBesideACurveOverTheReference) {
  int within = 0, places = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const TableDiscovery d = discovered(railOf(cyclic, seed));
    ASSERT_EQ(d.finding.effects.size(), 1u) << verdictOf(d);
    const Effect& effect = d.finding.effects[0];
    ASSERT_FALSE(isFormula(effect)) << effect.name;
    for (const Estimate& one : namedNuisances(d)) EXPECT_NE(one.name, "gain");
    EXPECT_THAT(modelToml(d), HasSubstr("# No gain is fitted: an effect that goes with reference_mm contains it"));
    EXPECT_GT(d.judged.removed, 0.85);
    const Level level = levelOf(effect, d.open);
    double mean = 0.0;
    for (const double x : d.open.reference) mean += cyclic(x) / static_cast<double>(d.open.rows());
    for (double x = 600.0; x <= 6800.0; x += 200.0, ++places) {
      const Point point = effectAt(effect, {{"reference_mm", x}}, level);
      within += std::abs(point.value - (cyclic(x) - mean)) < 2.0 * point.error;
    }
  }
  EXPECT_GT(within, 0.88 * places);
}

/// An exponential whose length is beyond the rail is nearly a line and a parabola: its numbers are as uncertain.
TEST(Gain, IsAsUncertainAsAFormulaThatIsNearlyALineMakesIt) {
  constexpr double kGain = 0.002, kLength = 5000.0, kHeight = -60.0;
  int gains = 0, found = 0;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const auto at = [](double x) { return kGain * x + kHeight * std::exp(-x / kLength); };
    const TableDiscovery d = discovered(railOf(at, seed, 0.5));
    if (d.finding.effects.size() != 1 || d.finding.effects[0].name != "exponential in reference_mm") continue;
    const Estimate& gain = d.finding.nuisances[1];
    ASSERT_EQ(gain.name, "gain");
    gains += std::abs(gain.value - kGain) < 2.5 * gain.error;
    ++found;
    EXPECT_GT(gain.error, 1e-4) << "without the exponential it would be 1e-5";
  }
  EXPECT_GE(gains, found - 2) << found;
  EXPECT_GE(found, 1);
}

TEST(Gain, StaysWhereAnEffectGoesWithSomethingElse) {
  std::mt19937 random{3};
  std::normal_distribution<double> normal;
  std::string text = "reference_mm,measured_mm,temp_C\n";
  for (int i = 0; i < kRailRows; ++i) {
    const double x = 500.0 + 17.0 * ((i * 77) % kRailRows), warmer = normal(random);
    text += fmt::format("{},{:.3f},{:.3f}\n", x, 1.001 * x + 3.0 * warmer + normal(random), warmer);
  }
  const TableDiscovery d = discovered(text);
  ASSERT_FALSE(d.finding.effects.empty());
  EXPECT_EQ(namedNuisances(d)[1].name, "gain");
  EXPECT_NEAR(namedNuisances(d)[1].value, 0.001, 4.0 * namedNuisances(d)[1].error);
  EXPECT_THAT(modelToml(d), Not(HasSubstr("No gain is fitted")));
}

}  // namespace
}  // namespace toftwin::discover
