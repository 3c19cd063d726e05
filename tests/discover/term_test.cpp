// SPDX-License-Identifier: Apache-2.0
// Functions of covariates, and the bases made of them.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "calib/discover/candidates.h"
#include "calib/discover/forms.h"
#include "calib/discover/term.h"

namespace toftwin::discover {
namespace {

double at(Shape shape, std::vector<double> numbers, double x) {
  return Factor{"x", shape, std::move(numbers)}.at(x);
}

TEST(Factor, IsTheFunctionThatItsNameSays) {
  EXPECT_DOUBLE_EQ(at(Shape::Power, {-2.0}, 4.0), 1.0 / 16.0);
  EXPECT_DOUBLE_EQ(at(Shape::Log, {}, std::numbers::e), 1.0);
  EXPECT_DOUBLE_EQ(at(Shape::Decay, {2.0, 1.0}, 3.0), std::exp(-1.0));
  EXPECT_NEAR(at(Shape::Sine, {4.0}, 1.0), 1.0, 1e-15);
  EXPECT_NEAR(at(Shape::Cosine, {4.0}, 2.0), -1.0, 1e-15);
  EXPECT_EQ(at(Shape::Step, {2.0}, 2.0), 1.0);
  EXPECT_EQ(at(Shape::Step, {2.0}, 1.999), 0.0);
  EXPECT_DOUBLE_EQ(at(Shape::Sigmoid, {2.0, 0.5}, 2.0), 0.5);
  EXPECT_EQ(at(Shape::Equal, {3.0}, 3.0), 1.0);
  EXPECT_EQ(at(Shape::Modulo, {2.0, 1.0}, -3.0), 1.0) << "a negative odd number is odd";
}

TEST(Factor, HatIsOneAtItsMiddleAndBeyondAnOpenEnd) {
  EXPECT_DOUBLE_EQ(at(Shape::Hat, {0.0, 1.0, 3.0}, 0.25), 0.25);
  EXPECT_DOUBLE_EQ(at(Shape::Hat, {0.0, 1.0, 3.0}, 2.0), 0.5);
  EXPECT_EQ(at(Shape::Hat, {0.0, 1.0, 3.0}, 3.5), 0.0);
  EXPECT_EQ(at(Shape::Hat, {1.0, 1.0, 3.0}, -7.0), 1.0);
  EXPECT_EQ(at(Shape::Hat, {1.0, 3.0, 3.0}, 9.0), 1.0);
}

/// Hats with all their neighbours add up to one everywhere; the first is left to the offset.
TEST(SmoothIn, IsHatsThatAddUpToOneWithTheMissingFirst) {
  CovariateInfo x{.name = "x", .unit = ""};
  for (int i = 0; i <= 32; ++i) x.quantiles.push_back(i * i);
  const TermGroup smooth = smoothIn(x, 9);
  ASSERT_EQ(smooth.terms.size(), 8u);
  const double first_knot = 0.0, second_knot = 16.0;
  for (double value = 0.0; value <= 1024.0; value += 7.3) {
    double sum = Factor{"x", Shape::Hat, {first_knot, first_knot, second_knot}}.at(value);
    for (const Term& term : smooth.terms) sum += term.at([&](const std::string&) { return value; });
    EXPECT_NEAR(sum, 1.0, 1e-12) << value;
  }
}

TEST(Term, IsTheProductOfItsFactorsInWordsToo) {
  const Term term{{{"a", Shape::Power, {1.0}}, {"b", Shape::Power, {-1.0}}}, {}};
  EXPECT_DOUBLE_EQ(term.at([](const std::string& name) { return name == "a" ? 6.0 : 4.0; }), 1.5);
  EXPECT_EQ(inWords(term), "a · 1/b");
}

TEST(Forms, HaveHarmonicsOnlyOfDistancesThatAreLongEnoughToShowThem) {
  CovariateInfo d{.name = "d", .unit = "m", .nature = Nature::Distance};
  for (int i = 0; i <= 32; ++i) d.quantiles.push_back(1.0 + i / 32.0);
  d.period = 5.2;
  std::size_t harmonics = 0;
  for (const Form& form : formsIn(d)) harmonics += form.name.find("per period") != std::string::npos;
  EXPECT_EQ(harmonics, 5u) << "a metre is less than 0.6 of a wave of 5.2/3 m, more of 5.2/4 … 5.2/8 m";
}

}  // namespace
}  // namespace toftwin::discover
