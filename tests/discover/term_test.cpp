// SPDX-License-Identifier: Apache-2.0
// Functions of covariates, and the bases made of them.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "calib/discover/candidates.h"
#include "calib/discover/forms.h"
#include "calib/discover/term.h"

namespace toftwin::discover {
namespace {

/// Hats with all their neighbours add up to one everywhere; the first is left to the offset.
TEST(SmoothIn, IsHatsThatAddUpToOneWithTheMissingFirst) {
  CovariateInfo x{.name = "x", .unit = ""};
  for (int i = 0; i <= 32; ++i) x.quantiles.push_back(i * i);
  const TermGroup smooth = smoothIn(x, 9);
  ASSERT_EQ(smooth.terms.size(), 8u);
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const double first_knot = 0.0, second_knot = 16.0;
  for (double value = 0.0; value <= 1024.0; value += 7.3) {
    double sum = terms::valueOf(factorOf("x", Basis::Hat, {-kFar, first_knot, second_knot}), value);
    for (const Term& term : smooth.terms) sum += term.at([&](const std::string&) { return value; });
    EXPECT_NEAR(sum, 1.0, 1e-12) << value;
  }
}

TEST(Term, IsTheProductOfItsFactorsInWordsToo) {
  const Term term{{factorOf("a", Basis::Power, {1.0}), factorOf("b", Basis::Power, {-1.0})}, {}};
  EXPECT_DOUBLE_EQ(term.at([](const std::string& name) { return name == "a" ? 6.0 : 4.0; }), 1.5);
  EXPECT_EQ(inWords(term), "a · 1/b");
  Factor below = factorOf("a", Basis::Hinge, {-150.0});
  below.of.parts[0].weight = -1.0;
  EXPECT_EQ(inWords(below), "max(0, 150 − a)");
  Factor checker = factorOf("column", Basis::Class, {2.0, 1.0});
  checker.of.parts.push_back({1.0, "row"});
  EXPECT_EQ(inWords(checker), "[(column + row) mod 2 = 1]");
}

TEST(Forms, HaveHarmonicsOnlyOfDistancesThatAreLongEnoughToShowThem) {
  CovariateInfo d{.name = "d", .unit = "m", .nature = Nature::Distance};
  for (int i = 0; i <= 32; ++i) d.quantiles.push_back(1.0 + i / 32.0);
  d.period = 5.2;
  std::size_t harmonics = 0;
  for (const Form& form : formsIn(d)) harmonics += form.name.find("per period") != std::string::npos;
  EXPECT_EQ(harmonics, 6u)
      << "a metre is less than 0.6 of a wave of 5.2/3 m, more of 5.2/4 … 5.2/8 m; and 4 with 8";
}

CovariateInfo spread(const std::string& name, double low, double high) {
  CovariateInfo x{.name = name};
  for (int i = 0; i <= 32; ++i) x.quantiles.push_back(low + (high - low) * i / 32.0);
  return x;
}

/// Of forms, or of groups.
template <class Named>
std::vector<std::string> namesOf(const std::vector<Named>& all) {
  std::vector<std::string> names;
  for (const Named& one : all) names.push_back(one.name);
  return names;
}

TEST(Forms, OfAnglesHaveTanSquaredInDegreesOrRadians) {
  CovariateInfo x = spread("x", 0.0, 60.0);
  EXPECT_THAT(namesOf(formsIn(x)), testing::Not(testing::Contains("tan² of x")));
  x.nature = Nature::Angle;
  for (const auto& [unit, high] : {std::pair{"deg", 60.0}, {"", 60.0}, {"rad", 1.0}, {"", 1.0}}) {
    x.quantiles = spread("x", 0.0, high).quantiles, x.unit = unit;
    const auto forms = formsIn(x);
    const auto tan = std::ranges::find(forms, "tan² of x", &Form::name);
    const auto secant = std::ranges::find(forms, "1/cos − 1 of x", &Form::name);
    ASSERT_TRUE(tan != forms.end() && secant != forms.end()) << unit << high;
    const double radians = high == 60.0 ? std::numbers::pi / 3.0 : 1.0;
    const auto value = [&](const Form& form) {
      return built(form, {}).terms[0].at([&](const auto&) { return high; });
    };
    EXPECT_NEAR(value(*tan), std::pow(std::tan(radians), 2), 1e-12);
    EXPECT_NEAR(value(*secant), 1.0 / std::cos(radians) - 1.0, 1e-12);
  }
  x.quantiles = spread("x", 0.0, 90.0).quantiles, x.unit = "deg";
  EXPECT_THAT(namesOf(formsIn(x)), testing::Not(testing::Contains("tan² of x"))) << "it has no end at 90°";
}

/// 0 °C is not "no temperature", so its inverse means nothing; that of 0 V does.
TEST(Forms, OfDegreesCelsiusHaveNoInverses) {
  CovariateInfo x = spread("x", 15.0, 40.0);
  EXPECT_THAT(namesOf(formsIn(x)), testing::IsSupersetOf({"1/x", "√x", "ln x", "x"}));
  x.unit = "c";
  for (const char* name : {"1/x", "1/x^2", "√x", "ln x"})
    EXPECT_THAT(namesOf(formsIn(x)), testing::Not(testing::Contains(name)));
  EXPECT_THAT(namesOf(formsIn(x)), testing::Contains("x"));
}

TEST(Candidates, OfFewCapturesHoldPairsOfThreeColumnsWhereTheyAreWanted) {
  const std::vector<CovariateInfo> infos{spread("a", 1.0, 2.0), spread("b", 3.0, 9.0)};
  const auto pairsWith = [&](std::size_t captures, bool straight) {
    std::vector<std::size_t> columns;
    for (const TermGroup& group :
         genericCandidates(infos, {.captures = captures, .has_straight_pairs = straight}))
      if (covariatesOf(group).size() == 2) columns.push_back(group.terms.size());
    return columns;
  };
  EXPECT_THAT(pairsWith(24, true), testing::ElementsAre(3));
  EXPECT_THAT(pairsWith(24, false), testing::IsEmpty());
  EXPECT_THAT(pairsWith(60, true), testing::ElementsAre(3, 15));
  EXPECT_THAT(pairsWith(60, false), testing::ElementsAre(15));
}

/// However many states a camera has, a place of the image and what is seen there have room.
TEST(Pairs, OfAPlaceAndASignalAreLookedForBesideThoseOfStates) {
  std::vector<CovariateInfo> covariates{spread("range_m", 1.0, 3.0), spread("radius_px", 0.0, 20.0)};
  covariates[0].word = "range", covariates[1].word = "position";
  for (int i = 0; i < 40; ++i) {
    covariates.push_back(spread(fmt::format("state {}", i), 1.0, 2.0));
    covariates.back().is_of_capture = true;
  }
  EXPECT_THAT(namesOf(genericCandidates(covariates, {.captures = 40})),
              testing::Contains("smooth in range_m and radius_px"));
}

/// x² crossed with a temperature of 23 °C and more: T x² and x², whose zero nobody knows.
TEST(CrossedForms, KeepTheirOwnWhereZeroIsNotNothing) {
  const CovariateInfo radius = spread("radius_px", 0.1, 20.0);
  CovariateInfo temperature = spread("temperature_sensor_c", 23.0, 35.0);
  temperature.unit = "c";
  for (Form& form : formsIn(radius)) {
    if (form.name != "radius_px^2") continue;
    FittedForm square{.form = form, .group = built(form, {})};
    const std::vector<FittedForm> crossed = crossedWith(square, temperature);
    ASSERT_FALSE(crossed.empty());
    const FittedForm& last = crossed.back();
    EXPECT_EQ(last.group.name, "radius_px^2 · temperature_sensor_c + radius_px^2");
    ASSERT_EQ(last.group.terms.size(), 2U);
    const auto at = [](const std::string& name) { return name == "radius_px" ? 3.0 : 30.0; };
    EXPECT_DOUBLE_EQ(last.group.terms[0].at(at), 270.0);
    EXPECT_DOUBLE_EQ(last.group.terms[1].at(at), 9.0);
    EXPECT_EQ(built(last.form, {}).terms.size(), 2U) << "also when it is built anew";
    return;
  }
  FAIL() << "no square among the forms";
}

}  // namespace
}  // namespace toftwin::discover
