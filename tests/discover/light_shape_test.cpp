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

/// What is told where a b + a was chosen, a curve along `a` being the other choice. The share by which a delay moves
/// rows goes with b by four fifths.
struct OfAPair {
  std::size_t place = 0;  ///< 0: the pair; 1: the curve
  std::vector<Explanation> all;
};
OfAPair toldOfAPair(const TwoCovariates::Hidden& hidden, std::uint64_t seed) {
  const Context context = contextOf(hidden, seed, 0.8);
  OfAPair told{.all = judged(context, {pairOf(), formOf("a", {powerOf("a", 1.0)})})};
  told.place = alongOne(context, told.all, 0).value_or(0);
  return told;
}

/// The pair says more than the curve by itself, 10² Σ a² (delay − mean)² = 100 × 2000/3 × 0.5²/12 × 0.68 = 944 in χ².
TEST(LightShape, APairThatSaysNoMoreThanACurveWithItsLightIsThatCurve) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const OfAPair told = toldOfAPair([](double a, double, double delay) { return 10.0 * a * delay; }, seed);
    EXPECT_TRUE(isMoreBy(100.0, told.all[0].gain, told.all[1].gain)) << "seed " << seed;
    EXPECT_EQ(told.place, 1U) << "seed " << seed;
  }
}

/// By 280 ± 35 in χ² more than the curve with its light, which is less than a twentieth of what it says.
TEST(LightShape, APairThatSaysMoreStaysOne) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const OfAPair told = toldOfAPair([](double a, double b, double) { return 10.0 * a * (b - 0.3); }, seed);
    EXPECT_EQ(told.place, 0U) << "seed " << seed;
  }
}

/// A curve that predicts nothing by itself, as its light hides it, would end the search: then the pair is told.
TEST(LightShape, ACurveThatPredictsNothingIsNotTold) {
  const Context context = contextOf([](double a, double, double delay) { return 10.0 * a * (delay - 1.25); }, 1, 1.0);
  const std::vector<Explanation> all = judged(context, {pairOf(), formOf("a", {powerOf("a", 1.0)})});
  ASSERT_FALSE(holds(all[1].gain));
  EXPECT_FALSE(alongOne(context, all, 0));
}

}  // namespace
}  // namespace toftwin::discover
