// SPDX-License-Identifier: Apache-2.0
#include "sim/terms/term.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include <toftwin/nan.h>

namespace toftwin::terms {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double at(double x, Basis basis, std::vector<double> numbers = {}) {
  return valueOf(Factor{.basis = basis, .of = {{{1.0, "x"}}}, .numbers = std::move(numbers)}, x);
}

TEST(Basis, PowerLogAndDecay) {
  EXPECT_EQ(at(3.0, Basis::Power, {2.0}), 9.0);
  EXPECT_EQ(at(4.0, Basis::Power, {-0.5}), 0.5);
  EXPECT_DOUBLE_EQ(at(std::numbers::e, Basis::Log), 1.0);
  EXPECT_DOUBLE_EQ(at(400.0, Basis::Decay, {400.0}), std::exp(-1.0));
}

TEST(Basis, SineAndCosineAreTheLibrarysWithinRounding) {
  // Of 2π turns alone, up to 44: half a unit in its last place is 3.6e-15, and as much for π's own rounding.
  for (double turns = -7.0; turns < 7.0; turns += 0.0137) {
    EXPECT_NEAR(at(256.0 * turns, Basis::Sine, {256.0}), std::sin(2.0 * std::numbers::pi * turns), 8e-15) << turns;
    EXPECT_NEAR(at(256.0 * turns, Basis::Cosine, {256.0}), std::cos(2.0 * std::numbers::pi * turns), 8e-15) << turns;
  }
}

TEST(Basis, SawtoothRisesFromMinusHalfToHalfInEachPeriod) {
  EXPECT_EQ(at(0.0, Basis::Sawtooth, {8.0, 0.0}), -0.5);
  EXPECT_EQ(at(6.0, Basis::Sawtooth, {8.0, 0.0}), 0.25);
  EXPECT_EQ(at(-2.0, Basis::Sawtooth, {8.0, 0.0}), 0.25);
  EXPECT_EQ(at(3.0, Basis::Sawtooth, {8.0, 3.0}), -0.5);
}

TEST(Basis, StepSigmoidAndHingeTurnAtA) {
  EXPECT_EQ(at(2.0, Basis::Step, {2.0}), 1.0);
  EXPECT_EQ(at(std::nextafter(2.0, 0.0), Basis::Step, {2.0}), 0.0);
  EXPECT_EQ(at(2.0, Basis::Sigmoid, {2.0, 0.5}), 0.5);
  EXPECT_DOUBLE_EQ(at(2.5, Basis::Sigmoid, {2.0, 0.5}), 1.0 / (1.0 + std::exp(-1.0)));
  EXPECT_EQ(at(5.0, Basis::Hinge, {2.0}), 3.0);
  EXPECT_EQ(at(1.0, Basis::Hinge, {2.0}), 0.0);
}

TEST(Basis, BumpAndHatAreOneInTheMiddle) {
  EXPECT_EQ(at(2.0, Basis::Bump, {2.0, 0.5}), 1.0);
  EXPECT_DOUBLE_EQ(at(2.5, Basis::Bump, {2.0, 0.5}), std::exp(-0.5));
  EXPECT_EQ(at(2.0, Basis::Hat, {1.0, 2.0, 4.0}), 1.0);
  EXPECT_EQ(at(1.5, Basis::Hat, {1.0, 2.0, 4.0}), 0.5);
  EXPECT_EQ(at(3.5, Basis::Hat, {1.0, 2.0, 4.0}), 0.25);
  EXPECT_EQ(at(9.0, Basis::Hat, {1.0, 2.0, 4.0}), 0.0);
}

TEST(Basis, AHatWithAnInfiniteSideIsOneThere) {
  EXPECT_EQ(at(-1e9, Basis::Hat, {-kInfinity, 2.0, 4.0}), 1.0);
  EXPECT_EQ(at(1e9, Basis::Hat, {1.0, 2.0, kInfinity}), 1.0);
}

TEST(Basis, ACurveIsStraightBetweenItsKnotsAndConstantBeyond) {
  const std::vector<double> knots{1.0, 10.0, 2.0, 20.0, 4.0, 0.0};
  EXPECT_EQ(at(0.0, Basis::Curve, knots), 10.0);
  EXPECT_EQ(at(1.5, Basis::Curve, knots), 15.0);
  EXPECT_EQ(at(2.0, Basis::Curve, knots), 20.0);
  EXPECT_EQ(at(3.0, Basis::Curve, knots), 10.0);
  EXPECT_EQ(at(5.0, Basis::Curve, knots), 0.0);
  EXPECT_EQ(at(5.0, Basis::Curve, {1.0, 7.0}), 7.0);
}

TEST(Basis, ClassCountsFromZeroAlsoBelowZero) {
  EXPECT_EQ(at(10.0, Basis::Class, {8.0, 2.0}), 1.0);
  EXPECT_EQ(at(10.9, Basis::Class, {8.0, 2.0}), 1.0);
  EXPECT_EQ(at(-6.0, Basis::Class, {8.0, 2.0}), 1.0);
  EXPECT_EQ(at(11.0, Basis::Class, {8.0, 2.0}), 0.0);
}

TEST(Basis, AnglesAreInDegrees) {
  EXPECT_DOUBLE_EQ(at(60.0, Basis::Secant), 1.0 / std::cos(std::numbers::pi / 3.0) - 1.0);
  EXPECT_NEAR(at(60.0, Basis::Tangent2), 3.0, 1e-14);
}

TEST(Basis, IsNaNOutsideOfWhatItIsDefinedFor) {
  EXPECT_TRUE(std::isnan(at(0.0, Basis::Log)));
  EXPECT_TRUE(std::isnan(at(-1.0, Basis::Power, {0.5})));
  EXPECT_TRUE(std::isnan(at(0.0, Basis::Power, {-1.0})));
  EXPECT_TRUE(std::isnan(at(90.0, Basis::Secant)));
  EXPECT_TRUE(std::isnan(at(-1e6, Basis::Decay, {1.0})));
}

TEST(Basis, IsNaNWhereItsArgumentIs) {
  const std::vector<std::pair<Basis, std::vector<double>>> all{
      {Basis::Power, {0.0}},     {Basis::Log, {}},       {Basis::Decay, {1.0}},      {Basis::Sine, {1.0}},
      {Basis::Cosine, {1.0}},    {Basis::Sawtooth, {1.0, 0.0}}, {Basis::Step, {1.0}},     {Basis::Sigmoid, {1.0, 1.0}},
      {Basis::Hinge, {1.0}},     {Basis::Bump, {1.0, 1.0}}, {Basis::Hat, {0.0, 1.0, 2.0}},
      {Basis::Curve, {0.0, 1.0}}, {Basis::Class, {2.0, 1.0}}, {Basis::Secant, {}},   {Basis::Tangent2, {}}};
  for (const auto& [basis, numbers] : all)
    EXPECT_TRUE(std::isnan(at(kNaN, basis, numbers))) << static_cast<int>(basis);
}

Lookup lookupIn(std::map<std::string, double, std::less<>> numbers, std::string_view sensor = {}) {
  return [numbers = std::move(numbers), sensor](std::string_view name) -> Known {
    if (name == "sensor") return {kNaN, sensor};
    const auto found = numbers.find(name);
    return {found == numbers.end() ? kNaN : found->second, {}};
  };
}

TEST(Term, IsItsCoefficientTimesItsFactors) {
  const Term term = *parseTerm("range_mm += -6 * hinge(range_mm, 1000) * decay(time_s, 400)");
  EXPECT_DOUBLE_EQ(valueOf(term, lookupIn({{"range_mm", 1500.0}, {"time_s", 400.0}})), -3000.0 * std::exp(-1.0));
}

TEST(Term, OfAWeightedSumIsACheckerboard) {
  const Term term = *parseTerm("range_mm += 1.5 * class(column + row, 2, 1)");
  EXPECT_EQ(valueOf(term, lookupIn({{"column", 3.0}, {"row", 4.0}})), 1.5);
  EXPECT_EQ(valueOf(term, lookupIn({{"column", 3.0}, {"row", 5.0}})), 0.0);
}

TEST(Term, OfALevelGoesByTheCategorysName) {
  const Term term = *parseTerm("range_mm += 12.5 * level(sensor, 'tof0')");
  EXPECT_EQ(valueOf(term, lookupIn({}, "tof0")), 12.5);
  EXPECT_EQ(valueOf(term, lookupIn({}, "tof1")), 0.0);
  EXPECT_TRUE(std::isnan(valueOf(term, lookupIn({}))));
}

TEST(Term, ThatIsNotKnownAddsNothingToASum) {
  const std::vector<Term> terms{*parseTerm("range_mm += 2"), *parseTerm("range_mm += 3 * gain"),
                                *parseTerm("range_mm += 5 * row")};
  EXPECT_EQ(sumOf(terms, lookupIn({{"row", 10.0}})), 52.0);
}

TEST(Term, CovariatesAreListedOnceInTheirOrder) {
  EXPECT_EQ(covariatesOf({*parseTerm("range_mm += 1 * class(row + column, 2, 1)"),
                          *parseTerm("range_mm += 1 * column * decay(time_s, 4)")}),
            (std::vector<std::string>{"row", "column", "time_s"}));
}

TEST(Term, StageIsTheQuantitysOwn) {
  EXPECT_EQ(stageOf(Quantity::LightPercent), Stage::Light);
  EXPECT_EQ(stageOf(Quantity::QuadratureE), Stage::Samples);
  EXPECT_EQ(stageOf(Quantity::InvalidPercent), Stage::Range);
  EXPECT_EQ(stageOf(Quantity::Value), Stage::Range);
}

}  // namespace
}  // namespace toftwin::terms
