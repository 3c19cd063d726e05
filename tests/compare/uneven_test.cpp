// SPDX-License-Identifier: Apache-2.0
// Errors by what each row leaves.
#include "calib/compare/traits/uneven.h"

#include <gtest/gtest.h>

#include <cmath>

#include "calib/compare/statistics.h"

namespace toftwin::compare {
namespace {

const std::vector<double> kFew{1.0, 2.0, 4.0}, kMany{10.0, 30.0, 50.0, 20.0, 60.0};

/// Of n rows alike they are s²/n with n − 1 degrees of freedom, as least squares have them.
TEST(ErrorsByRows, OfAMeanAreItsOwn) {
  const Model mean = [](std::span<const double> p, std::size_t) { return p[0]; };
  auto fit = fitLeastSquares(mean, kMany, {0.0});
  ASSERT_TRUE(fit);
  const double before = fit->covariance[0];
  tellErrorsByRows(*fit, mean, kMany);
  EXPECT_NEAR(fit->covariance[0], before, 1e-9 * before);
}

/// Of the difference of two means they are s₁²/n₁ + s₂²/n₂ (B. L. Welch, Biometrika 34 (1947) 28), where least squares
/// have one s² of both. Satterthwaite's degrees of rows that are all alike are (1/n₁ + 1/n₂)²/(1/(n₁² (n₁ − 1)) + …).
TEST(ErrorsByRows, OfADifferenceOfMeansAreWelchs) {
  std::vector<double> y = kFew;
  y.insert(y.end(), kMany.begin(), kMany.end());
  const Model two = [](std::span<const double> p, std::size_t i) { return p[0] + (i < kFew.size() ? 0.0 : p[1]); };
  auto fit = fitLeastSquares(two, y, {0.0, 0.0});
  ASSERT_TRUE(fit);
  tellErrorsByRows(*fit, two, y);
  const double few = summarise(kFew).sd, many = summarise(kMany).sd, welch = few * few / 3.0 + many * many / 5.0;
  const double degrees = std::pow(1.0 / 3.0 + 1.0 / 5.0, 2) / (1.0 / (9.0 * 2.0) + 1.0 / (25.0 * 4.0));
  const double wider = std::pow(studentT(degrees) / studentT(6.0), 2);
  EXPECT_NEAR(fit->covariance[3], welch * wider, 1e-7 * welch);
}

/// A mean of three rows beside one of thirty: two degrees of freedom tell it. Of two means of thirty each nothing is
/// changed, whatever they scatter by.
TEST(ErrorsByRows, CountWhereFewRowsTellANumber) {
  std::vector<double> y = kFew;
  for (int i = 0; i < 30; ++i) y.push_back(10.0 + 20.0 * (i % 3));
  std::size_t first = kFew.size();
  const Model two = [&](std::span<const double> p, std::size_t i) { return i < first ? p[0] : p[1]; };
  auto fit = fitLeastSquares(two, y, {0.0, 0.0});
  ASSERT_TRUE(fit);
  tellErrorsByRowsOfFew(*fit, two, y);
  const double sd = summarise(kFew).sd, wider = studentT(2.0) / studentT(31.0);
  EXPECT_NEAR(fit->covariance[0], sd * sd / 3.0 * wider * wider, 1e-7 * fit->covariance[0]);
  y.insert(y.end(), 27, 2.0), first = 30;
  auto many = fitLeastSquares(two, y, {0.0, 0.0});
  ASSERT_TRUE(many);
  const std::vector<double> before = many->covariance;
  tellErrorsByRowsOfFew(*many, two, y);
  EXPECT_EQ(many->covariance, before);
}

}  // namespace
}  // namespace toftwin::compare
