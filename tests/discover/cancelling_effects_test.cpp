// SPDX-License-Identifier: Apache-2.0
// Two covariates that are nearly one.
#include "calib/discover/cancelling_effects.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/discover/discovered.h"
#include "tests/discover/two_covariates.h"

namespace toftwin::discover {
namespace {

Effect along(const char* covariate, double power) {
  Effect effect;
  effect.name = covariate, effect.covariates = {covariate}, effect.stage = Stage::Range;
  effect.parts = {formOf(covariate, {powerOf(covariate, power)})};
  return effect;
}

/// What a curve along a and another along b become; so much of b goes with a.
std::vector<Effect> joined(const TwoCovariates::Hidden& hidden, const Effect& a, const Effect& b, double alike = 0.95) {
  Found found;
  found.context = contextOf(hidden, 1, 0.0, alike);
  found.effects = {a, b};
  joinCancelling(found);
  return found.effects;
}

TEST(JoinCancelling, WhatACurveAlongOneSaysAsWellGoesAlongOne) {
  const auto found = joined([](double a, double, double) { return 40.0 * (a * a - a); }, along("a", 2.0), along("b", 1.0));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].covariates, (std::vector<std::string>{"a"}));
  EXPECT_EQ(found[0].parts.size(), 1U);
}

TEST(JoinCancelling, WhatTheDifferenceSaysGoesAlongBoth) {
  const auto found = joined([](double a, double b, double) { return 400.0 * (a - b); }, along("a", 1.0), along("b", 1.0));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].covariates, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(found[0].parts.size(), 2U);
  EXPECT_TRUE(found[0].predicts);
  EXPECT_GT(found[0].frequency, 0.95);
}

TEST(JoinCancelling, WhatAddsUpStaysTwo) {
  const auto found = joined([](double a, double b, double) { return 40.0 * (a + b); }, along("a", 1.0), along("b", 1.0));
  EXPECT_EQ(found.size(), 2U);
}

/// Covariates of correlation 0.7: each says for itself what goes with it.
TEST(JoinCancelling, WhatCancelsAlongCovariatesThatAreTwoStaysTwo) {
  const auto found =
      joined([](double a, double b, double) { return 40.0 * (a - b); }, along("a", 1.0), along("b", 1.0), 0.5);
  EXPECT_EQ(found.size(), 2U);
}

/// a goes with b (0.99), and both with nothing of the temperature, which is found all the same.
TEST(JoinCancelling, WhatIsNeitherOfBothIsAnEffectOfItsOwn) {
  std::mt19937_64 bits{7};
  const auto uniform = [&] { return static_cast<double>(bits() >> 11) * 0x1p-53; };
  std::string table = "error_mm,a,b,temperature_c\n";
  for (int i = 0; i < 600; ++i) {
    const double a = uniform(), b = a + 0.1 * (uniform() - 0.5), temperature = 20.0 + 20.0 * uniform();
    double noise = -6.0;
    for (int k = 0; k < 12; ++k) noise += uniform();
    table += fmt::format("{:.4f},{:.5f},{:.5f},{:.3f}\n",
                         100.0 * a + 120.0 * (a - b) + 0.25 * (temperature - 30.0) + 0.5 * noise, a, b, temperature);
  }
  const TableDiscovery found = discovered(table);
  ASSERT_EQ(found.finding.effects.size(), 2U);
  EXPECT_EQ(found.finding.effects[0].covariates, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(found.finding.effects[0].name, "a + b");
  EXPECT_EQ(found.finding.effects[1].covariates, (std::vector<std::string>{"temperature_c"}));
  EXPECT_LT(found.judged.after.rms, 0.6);  // the noise, 0.5, of a hundred rows: its standard error is 0.035
}

}  // namespace
}  // namespace toftwin::discover
