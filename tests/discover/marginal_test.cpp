// SPDX-License-Identifier: Apache-2.0
// Gram matrices with random effects integrated out, against the same with all rows written out.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "calib/discover/cross_validation.h"
#include "calib/discover/marginal.h"

namespace toftwin::discover {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The first column is drawn anew for each capture.
struct Rows {
  std::vector<MatrixXd> x;
  std::vector<VectorXd> y;
  Evidence evidence;
};

Rows rowsOf(int captures, int rows, double deviation, std::uint64_t seed) {
  std::mt19937_64 bits{seed};
  const auto normal = [&] {
    double sum = -6.0;  // twelve uniform numbers: near enough to normal, and the same everywhere
    for (int i = 0; i < 12; ++i) sum += static_cast<double>(bits() >> 11) * 0x1p-53;
    return sum;
  };
  Rows out;
  out.evidence.groups = {{.name = "pose", .kind = Kind::PerCapture, .first = 0, .count = 1},
                         {.name = "offset", .kind = Kind::Nuisance, .first = 1, .count = 1},
                         {.name = "effect", .kind = Kind::Generic, .first = 2, .count = 1}};
  for (int c = 0; c < captures; ++c) {
    MatrixXd x(rows, 3);
    VectorXd y(rows);
    const double pose = deviation * normal();
    for (int i = 0; i < rows; ++i) {
      x.row(i) << 1.0, 1.0, normal();
      y(i) = pose + 2.0 + 0.5 * x(i, 2) + normal();
    }
    out.evidence.captures.push_back(
        {x.transpose() * x, x.transpose() * y, y.squaredNorm(), static_cast<double>(rows), "", ""});
    out.x.push_back(std::move(x)), out.y.push_back(std::move(y));
  }
  return out;
}

TEST(Marginalise, IsGeneralisedLeastSquaresOverAllRows) {
  const Rows rows = rowsOf(7, 5, 1.5, 3);
  const double scale = 1.3;
  MatrixXd gram = MatrixXd::Zero(2, 2);
  VectorXd moment = VectorXd::Zero(2);
  double energy = 0.0, log_determinant = 0.0;
  for (std::size_t c = 0; c < rows.x.size(); ++c) {
    const MatrixXd z = rows.x[c].leftCols(1), x = rows.x[c].rightCols(2);
    const MatrixXd v = MatrixXd::Identity(5, 5) + scale * scale * z * z.transpose();
    gram += x.transpose() * v.inverse() * x, moment += x.transpose() * v.inverse() * rows.y[c];
    energy += rows.y[c].dot(v.inverse() * rows.y[c]), log_determinant += std::log(v.determinant());
  }
  const Marginal marginal = marginalise(rows.evidence, std::vector<double>{scale});
  // Rounding of sums of some hundred products of numbers near one.
  EXPECT_LT((marginal.gram - gram).cwiseAbs().maxCoeff(), 1e-11);
  EXPECT_LT((marginal.moment - moment).cwiseAbs().maxCoeff(), 1e-11);
  EXPECT_NEAR(marginal.energy, energy, 1e-10);
  EXPECT_NEAR(marginal.log_determinant, log_determinant, 1e-12);
}

/// At 0.5 the 200 captures' means vary by 0.5² + 1/8, known to √(2/200) = 10 %: the deviation to 7.5 %, three
/// of which and half of the grid's step of 20 % are 33 %; less at larger ones.
TEST(EstimateScales, FindsTheDeviationOfWhatIsDrawnAnew) {
  for (const double truth : {0.5, 1.0, 3.0}) {
    const auto scale = estimateScales(rowsOf(200, 8, truth, 11).evidence, {});
    ASSERT_EQ(scale.size(), 1u);
    EXPECT_NEAR(scale[0] / truth, 1.0, 0.33) << truth;
  }
}

/// The columns are 1.5 times as large as what each capture shows of them, since captures have it in common.
TEST(EstimateScales, WhatCapturesHaveInCommonIsLargerThanEachSays) {
  Rows rows = rowsOf(200, 8, 1.0, 11);
  const double alone = estimateScales(rows.evidence, {}).front();
  rows.evidence.groups.front().alike = 1.5;
  EXPECT_DOUBLE_EQ(estimateScales(rows.evidence, {}).front(), 1.5 * alone);
  rows.evidence.groups.front().most_scale = 0.3;
  EXPECT_DOUBLE_EQ(estimateScales(rows.evidence, {}).front(), 0.3);
}

TEST(PseudoInverse, LeavesOutWhatTwoEqualColumnsCannotTell) {
  MatrixXd gram(2, 2);
  gram << 2.0, 2.0, 2.0, 2.0;
  const PseudoInverse inverse = pseudoInverse(gram);
  EXPECT_EQ(inverse.rank, 1);
  EXPECT_NEAR((inverse.inverse * VectorXd::Constant(2, 4.0)).sum(), 2.0, 1e-12);
}

/// The gain of a true effect is about its noncentrality: Σ (β x)² over all rows.
TEST(CrossValidate, GainsWhatTheEffectIsWorth) {
  const Rows rows = rowsOf(100, 8, 0.0, 5);
  double lambda = 0.0;
  for (const MatrixXd& x : rows.x) lambda += 0.25 * x.col(2).squaredNorm();
  const Marginal marginal = marginalise(rows.evidence, std::vector<double>{0.0});
  const auto gains = crossValidate(marginal, nuisanceColumns(marginal), {1});
  const Difference gain = against0(gains[0]);
  EXPECT_NEAR(gain.mean, lambda, 4.0 * gain.error) << "4 σ: once in 16,000";
  EXPECT_GT(gain.mean, 0.5 * lambda);
}

}  // namespace
}  // namespace toftwin::discover
