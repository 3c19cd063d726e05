// SPDX-License-Identifier: Apache-2.0
// Which parts an effect has.
#include "calib/discover/reshape_effects.h"

#include <gtest/gtest.h>

#include "tests/discover/two_covariates.h"

namespace toftwin::discover {
namespace {

/// What is left of an effect that was found as a² first, then as a² b.
Effect leftOf(const TwoCovariates::Hidden& hidden, std::uint64_t seed) {
  Found found;
  found.context = contextOf(hidden, seed);
  Effect effect;
  effect.name = "a² + a² b", effect.covariates = {"a", "b"}, effect.stage = Stage::Range;
  effect.gain.mean = 1.0, effect.tried.resize(1), effect.alternatives.resize(1);  // of what was found first
  effect.parts = {formOf("a²", {powerOf("a", 2.0)}), formOf("a² b", {powerOf("a", 2.0), powerOf("b", 1.0)})};
  found.effects.push_back(std::move(effect));
  dropNeedlessParts(found);
  return found.effects.front();
}

/// A part stays by chance where it predicts by two standard errors: less than one in 20. Of 20 seeds five or more
/// with 0.3 %.
TEST(DropNeedlessParts, WhatWasFoundFirstGoesIfTheRestSaysAsMuch) {
  int left = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Effect effect = leftOf([](double a, double b, double) { return 10.0 * a * a * b; }, seed);
    ASSERT_FALSE(effect.parts.empty());
    left += effect.parts.size() > 1 ? 1 : 0;
  }
  EXPECT_LT(left, 5);
}

/// What is said of it is said of what is left: 10² Σ (a² b)² = 100 × 2000 / 15 in χ², less what its mean explains.
TEST(DropNeedlessParts, WhatIsToldIsOfWhatIsLeft) {
  const Effect left = leftOf([](double a, double b, double) { return 10.0 * a * a * b; }, 1);
  ASSERT_EQ(left.parts.size(), 1U);
  EXPECT_GT(left.gain.mean, 1000.0);
  EXPECT_TRUE(left.predicts);
  EXPECT_NE(left.tried.size(), 1U);
  EXPECT_EQ(left.name, left.parts.front().group.name);
}

TEST(DropNeedlessParts, WhatIsNeededStays) {
  const Effect both = leftOf([](double a, double b, double) { return 10.0 * a * a * (1.0 + b); }, 1);
  EXPECT_EQ(both.parts.size(), 2U);
  EXPECT_EQ(both.name, "a² + a² b");
}

TEST(DropNeedlessParts, CovariatesAreThoseOfWhatIsLeft) {
  const Effect one = leftOf([](double a, double, double) { return 10.0 * a * a; }, 1);
  EXPECT_EQ(one.parts.size(), 1U);
  EXPECT_EQ(one.covariates, (std::vector<std::string>{"a"}));
}

}  // namespace
}  // namespace toftwin::discover
