// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/telling/told.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "calib/loop/grammar.h"
#include "calib/loop/projection.h"

namespace toftwin::loop {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// Rows with two columns; the second is the first and a little of its own.
Evidence rowsWith(double own) {
  std::mt19937_64 random{77};
  std::uniform_real_distribution<double> uniform{0.0, 100.0};
  Evidence e;
  constexpr Eigen::Index kRows = 500;
  Covariate a{.name = "a", .x = Eigen::VectorXd(kRows)}, b{.name = "b", .x = Eigen::VectorXd(kRows)};
  for (Eigen::Index i = 0; i < kRows; ++i) a.x[i] = uniform(random), b.x[i] = (1.0 - own) * a.x[i] + own * uniform(random);
  describe(a), describe(b);
  e.y = Eigen::VectorXd::Zero(kRows), e.sigma = Eigen::VectorXd::Ones(kRows);
  e.group.assign(kRows, 0), e.group_names = {""};
  e.covariates = {a, b};
  return e;
}
Effect lineOver(const Evidence& e, const std::string& name, double slope) {
  const Covariate* argument = e.find(name);
  Effect effect{.shape = shapeOf(*std::ranges::find(families(), "straight line", &Family::name), {&argument, 1}, {})};
  effect.coefficient = Eigen::VectorXd::Constant(1, slope);
  return effect;
}
Eigen::VectorXd aboutMean(const Eigen::VectorXd& values) { return values.array() - values.mean(); }

TEST(Told, EffectsThatTakeEachOtherBackAreToldAsTheirSum) {
  const Evidence e = rowsWith(0.002);
  const std::vector<Effect> effects{lineOver(e, "a", 9.0), lineOver(e, "b", -9.3)};
  const Eigen::VectorXd sum = aboutMean(9.0 * e.covariates[0].x - 9.3 * e.covariates[1].x);
  const auto told = toldOf(e, effects);
  ASSERT_EQ(told[0].with.size(), 2U);
  EXPECT_EQ(told[0].with, told[1].with);
  EXPECT_LT((told[0].sum - sum).cwiseAbs().maxCoeff(), 1e-9);
  // Neither is larger than what both say, and what both say is the sum but for what is left to them together.
  for (const Told& one : told) EXPECT_LE(spreadOf(one.curve), spreadOf(sum) + 1e-9);
  EXPECT_NEAR(spreadOf(sum - told[0].curve - told[1].curve), told[0].joint, 1e-9);
  EXPECT_LT(told[0].joint, 0.15 * spreadOf(sum));
}

TEST(Told, TheFirstIsTheMeanOfTheSumOverItsOwnPlaces) {
  const Evidence e = rowsWith(0.002);
  const auto told = toldOf(e, {lineOver(e, "a", 9.0), lineOver(e, "b", -9.3)});
  const Told& first = told[told[0].with.front()];
  const Eigen::VectorXd& x = e.covariates[told[0].with.front()].x;
  // In each tenth of its places the curve's mean is the sum's: the line passes through its dots.
  for (double low = 0.0; low < 100.0; low += 10.0) {
    double curve = 0.0, sum = 0.0, count = 0.0;
    for (Eigen::Index i = 0; i < x.size(); ++i)
      if (x[i] >= low && x[i] < low + 10.0) curve += first.curve[i], sum += first.sum[i], count += 1.0;
    if (count < 10.0) continue;
    EXPECT_NEAR(curve / count, sum / count, 0.1 * spreadOf(first.sum)) << low;
  }
}

/// Where the columns' small difference decides, neither says it alone.
TEST(Told, WhatOnlyBothSayIsNoneOfTheirs) {
  const Evidence e = rowsWith(0.05);
  const auto told = toldOf(e, {lineOver(e, "a", 9.0), lineOver(e, "b", -9.3)});
  EXPECT_GT(told[0].joint, 0.8 * spreadOf(told[0].sum));
  for (const Told& one : told) EXPECT_LT(spreadOf(one.curve), 0.6 * spreadOf(told[0].sum));
}

TEST(Told, EffectsThatDoNotAreToldAsTheyAre) {
  for (const double own : {1.0, 0.5}) {
    const Evidence e = rowsWith(own);
    const auto told = toldOf(e, {lineOver(e, "a", 2.0), lineOver(e, "b", 1.5)});
    for (const Told& one : told) EXPECT_THAT(one.with, IsEmpty());
    EXPECT_LT((told[0].curve - aboutMean(2.0 * e.covariates[0].x)).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(Told, OnlyThoseThatDoAreTogether) {
  Evidence e = rowsWith(0.05);
  Covariate c = e.covariates[0];
  c.name = "c";
  for (Eigen::Index i = 0; i < c.x.size(); ++i) c.x[i] = std::fmod(37.0 * static_cast<double>(i), 101.0);
  describe(c);
  e.covariates.push_back(c);
  const auto told = toldOf(e, {lineOver(e, "c", 1.0), lineOver(e, "a", 9.0), lineOver(e, "b", -9.3)});
  EXPECT_THAT(told[0].with, IsEmpty());
  EXPECT_THAT(told[1].with, ::testing::UnorderedElementsAre(1U, 2U));
}

}  // namespace
}  // namespace toftwin::loop
