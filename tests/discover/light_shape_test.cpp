// SPDX-License-Identifier: Apache-2.0
// What two covariates do together to the range, or to the light; and one of them to both.
#include "calib/discover/light_shape.h"

#include <gtest/gtest.h>

#include "tests/discover/two_covariates.h"

namespace toftwin::discover {
namespace {

/// The place of what a² b is told as, and all that it was chosen from.
std::pair<std::vector<Explanation>, std::optional<std::size_t>> told(double size, bool is_of_light,
                                                                     std::uint64_t seed) {
  const Context context = contextOf(
      [&](double a, double b, double delay) { return size * a * a * b * (is_of_light ? delay : 1.0); }, seed);
  std::vector<Explanation> all = judged(context, {formOf("a² b", {powerOf("a", 2.0), powerOf("b", 1.0)})});
  const auto place = lightShape(context, all, 0);
  return {std::move(all), place};
}

/// Expected gain: size² Σ (a² b (delay − mean))² = 25² × 2000 × 1/5 × 1/3 × 0.5²/12 = 1700 and more.
TEST(LightShape, ADelayAlongTwoCovariatesIsOne) {
  const auto [all, place] = told(25.0, true, 1);
  ASSERT_TRUE(place);
  EXPECT_EQ(all[*place].carrier(), "delay");
  EXPECT_EQ(all[*place].stage, Stage::Light);
  EXPECT_EQ(all[*place].covariates, (std::vector<std::string>{"a", "b", "delay"}));
}

TEST(LightShape, AnErrorOfTheRangeStaysOne) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto [all, place] = told(25.0, false, seed);
    EXPECT_FALSE(place) << "seed " << seed;
    EXPECT_EQ(all.size(), 1U);
  }
}

/// Too faint to tell (a gain of 0.004 of χ² expected): the simpler answer stands.
TEST(LightShape, WhatIsTooFaintToTellIsNotCalledLight) {
  int called = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) called += told(0.04, true, seed).second.has_value() ? 1 : 0;
  EXPECT_EQ(called, 0);
}

/// The place of what is told where a pair was chosen, a curve along `a` being the other choice; 0: the pair.
std::size_t toldOfAPair(const TwoCovariates::Hidden& hidden) {
  const Context context = contextOf(hidden, 1);
  const std::vector<Explanation> all =
      judged(context, {formOf("a b", {powerOf("a", 1.0), powerOf("b", 1.0)}), formOf("a", {powerOf("a", 1.0)})});
  return alongOne(context, all, 0).value_or(0);
}

TEST(LightShape, APairThatSaysNoMoreThanACurveWithItsLightIsThatCurve) {
  EXPECT_EQ(toldOfAPair([](double a, double b, double delay) { return 10.0 * a * (delay + 0.1 * b); }), 1U);
}

TEST(LightShape, APairThatSaysMoreStaysOne) {
  EXPECT_EQ(toldOfAPair([](double a, double b, double delay) { return 10.0 * a * (0.1 * delay + b); }), 0U);
}

}  // namespace
}  // namespace toftwin::discover
