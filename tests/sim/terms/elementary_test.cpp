// SPDX-License-Identifier: Apache-2.0
// Functions of our own that vectorise, beside the library's in extended precision.
#include "sim/terms/elementary.h"

#include <gtest/gtest.h>

#include <random>

#include "sim/terms/basis.h"

namespace toftwin::terms {
namespace {

/// Units of the last place that a double is off.
double unitsOff(double found, long double exact) {
  const double rounded = static_cast<double>(exact);
  return static_cast<double>(std::abs(static_cast<long double>(found) - exact)) / (std::nextafter(std::abs(rounded), INFINITY) - std::abs(rounded));
}

TEST(Elementary, ExponentialAndLogarithmAreWithinTwoUnitsOfTheLastPlace) {
  constexpr std::uint64_t kSeed = 452;
  std::mt19937_64 random{kSeed};
  for (int i = 0; i < 200'000; ++i) {
    const double x = std::uniform_real_distribution{i % 2 == 0 ? -700.0 : -3.0, i % 2 == 0 ? 700.0 : 3.0}(random);
    ASSERT_LT(unitsOff(exponential(x), std::exp(static_cast<long double>(x))), 2.0) << x << ", seed " << kSeed;
    const double y = i % 2 == 0 ? std::exp(x) : std::uniform_real_distribution{0.3, 3.0}(random);
    ASSERT_LT(unitsOff(naturalLogarithm(y), std::log(static_cast<long double>(y))), 2.0) << y << ", seed " << kSeed;
  }
}

TEST(Elementary, EndsWhereDoublesEnd) {
  EXPECT_EQ(exponential(0.0), 1.0);
  EXPECT_EQ(exponential(-800.0), 0.0);
  EXPECT_EQ(exponential(800.0), INFINITY);
  EXPECT_TRUE(std::isnan(exponential(kNaN)));
  EXPECT_EQ(naturalLogarithm(1.0), 0.0);
  EXPECT_DOUBLE_EQ(naturalLogarithm(5e-324), std::log(5e-324));
  for (const double x : {0.0, -1.0, static_cast<double>(INFINITY), static_cast<double>(kNaN)}) EXPECT_TRUE(std::isnan(naturalLogarithm(x))) << x;
}

TEST(BasisOfMany, OfSimplePowersGivesTheSameBitsAsOneAndNearlyThoseOfThePower) {
  for (const double n : {-2.0, -1.0, -0.5, 0.5, 1.0, 2.0, 3.0}) {
    const Factor factor{.basis = Basis::Power, .of = {{{1.0, "x"}}}, .numbers = {n}};
    std::vector<double> x, product;
    for (double at = -3.7; at < 4000.0; at += 7.31) x.push_back(at);
    product.assign(x.size(), 1.0);
    BasisOfMany{factor}.multiply(x, product);
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double one = valueOf(factor, x[i]), power = std::pow(x[i], n);
      ASSERT_EQ(std::isnan(product[i]), std::isnan(power)) << x[i] << "^" << n;
      if (std::isnan(power)) continue;
      ASSERT_EQ(product[i], one) << x[i] << "^" << n;
      ASSERT_LT(unitsOff(one, std::pow(static_cast<long double>(x[i]), static_cast<long double>(n))), 2.0) << x[i] << "^" << n;
    }
  }
}

}  // namespace
}  // namespace toftwin::terms
