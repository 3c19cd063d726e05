// SPDX-License-Identifier: Apache-2.0
#include "calib/linear/linear.h"

#include <gtest/gtest.h>

#include <cmath>

namespace toftwin::linear {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Of eigenvalues 1, 2 and 4 along (1, 1, 0)/√2, (1, −1, 0)/√2 and z.
MatrixXd known() { return MatrixXd{{1.5, -0.5, 0.0}, {-0.5, 1.5, 0.0}, {0.0, 0.0, 4.0}}; }

constexpr double kRounding = 1e-14;

TEST(Linear, EigenvaluesAscendAndVectorsAreTheirs) {
  const auto [values, vectors] = eigenpairs(known());
  EXPECT_LT((values - VectorXd{{1.0, 2.0, 4.0}}).norm(), kRounding);
  EXPECT_LT((eigenvalues(known()) - values).norm(), kRounding);
  EXPECT_NEAR(std::abs(vectors(0, 0) + vectors(1, 0)), std::sqrt(2.0), kRounding);
  EXPECT_LT((composed(vectors, values) - known()).norm(), 10 * kRounding);
}

TEST(Linear, OnlyTheLowerTriangleIsRead) {
  MatrixXd half = known();
  half(0, 1) = 7.0;
  EXPECT_LT((eigenvalues(half) - eigenvalues(known())).norm(), kRounding);
  EXPECT_LT((choleskyOf(half) - choleskyOf(known())).norm(), kRounding);
  EXPECT_LT((Ldlt{half}.inverse() - inverse(known())).norm(), kRounding);
}

TEST(Linear, AnIndefiniteMatrixIsSolvedToo) {
  const MatrixXd indefinite{{1.0, 2.0}, {2.0, 1.0}};  // eigenvalues 3 and −1
  EXPECT_LT((indefinite * Ldlt{indefinite}.solve(VectorXd{{5.0, 4.0}}) - VectorXd{{5.0, 4.0}}).norm(), kRounding);
  EXPECT_TRUE(choleskyOf(indefinite).array().isNaN().all());
}

TEST(Linear, WhatAMatrixDoesNotTellIsNothing) {
  const Ldlt flat{MatrixXd{{2.0, 0.0}, {0.0, 0.0}}};
  EXPECT_EQ(flat.solve(VectorXd{{4.0, 3.0}}), (VectorXd{{2.0, 0.0}}));
  EXPECT_EQ(flat.pivots().minCoeff(), 0.0);
}

TEST(Linear, ALowerTriangleIsSolvedForVectorsAndForColumns) {
  const MatrixXd lower = choleskyOf(known());
  EXPECT_LT((lower * lower.transpose() - known()).norm(), kRounding);
  EXPECT_LT((lower * solveLower(lower, VectorXd{{1.0, 2.0, 3.0}}) - VectorXd{{1.0, 2.0, 3.0}}).norm(), kRounding);
  EXPECT_LT((lower * solveLowerEach(lower, known()) - known()).norm(), kRounding);
  EXPECT_EQ(solveLowerEach(lower, MatrixXd(3, 0)).cols(), 0);
}

/// The second column is twice the first but for rounding: it spans nothing of its own.
TEST(Linear, ABasisHasNoColumnForWhatOthersSpan) {
  const MatrixXd columns{{1.0, 2.0, 0.0}, {1.0, 2.0 + 1e-12, 0.0}, {0.0, 0.0, 5.0}};
  const MatrixXd basis = basisOf(columns);
  ASSERT_EQ(basis.cols(), 2);
  EXPECT_LT((basis.transpose() * basis - MatrixXd::Identity(2, 2)).norm(), kRounding);
  EXPECT_LT((basis * (basis.transpose() * columns) - columns).norm(), 1e-11);
}

TEST(Linear, LeastSquaresLeavesWhatIsSquareToTheColumns) {
  const MatrixXd line{{1.0, 0.0}, {1.0, 1.0}, {1.0, 2.0}};
  const MatrixXd measured{{1.0}, {2.0}, {6.0}};
  const MatrixXd left = measured - line * leastSquares(line, measured);
  EXPECT_LT((line.transpose() * left).norm(), 10 * kRounding);
  EXPECT_NEAR(left.norm(), std::sqrt(1.5), 10 * kRounding);  // 0.5, −1, 0.5
}

TEST(Linear, ColumnsAreSolvedByThemselves) {
  const MatrixXd b{{1.0, 4.0}, {2.0, 5.0}, {3.0, 6.0}};
  const MatrixXd all = Ldlt{known()}.solveEach(b);
  EXPECT_LT((known() * all - b).norm(), 10 * kRounding);
  for (Eigen::Index c = 0; c < b.cols(); ++c)
    EXPECT_LT((all.col(c) - Ldlt{known()}.solve(b.col(c))).norm(), kRounding) << c;
}

/// What cannot be inverted has no inverse that passes for one.
TEST(Linear, ASingularMatrixHasNoInverse) {
  const MatrixXd singular{{1.0, 2.0}, {2.0, 4.0}};
  EXPECT_FALSE(inverse(singular).allFinite());
  EXPECT_EQ(Ldlt{singular}.pivots().minCoeff(), 0.0) << "of a pivot that is exactly 0 the condition knows nothing";
  EXPECT_GT(Ldlt{known()}.rcond(), 0.1);
}

TEST(Linear, OfNumbersThatAreNoneNothingComesThatPassesForOne) {
  MatrixXd none = known();
  none(1, 0) = std::nan("");
  EXPECT_FALSE(choleskyOf(none).allFinite());
  EXPECT_FALSE(inverse(none).allFinite());
  EXPECT_FALSE(Ldlt{none}.solve(VectorXd{{1.0, 2.0, 3.0}}).allFinite());
  EXPECT_FALSE(solveLower(known(), VectorXd{{1.0, std::nan(""), 3.0}}).allFinite());
  EXPECT_FALSE(leastSquares(none, MatrixXd::Ones(3, 1)).allFinite());
}

/// The second column is twice the first: one of many solutions comes, and what it leaves is what the first alone leaves.
TEST(Linear, LeastSquaresOfColumnsThatHangOnOneAnotherLeavesTheLeast) {
  const MatrixXd twice{{1.0, 2.0}, {1.0, 2.0}, {1.0, 2.0}}, measured{{1.0}, {2.0}, {6.0}};
  const MatrixXd x = leastSquares(twice, measured);
  ASSERT_TRUE(x.allFinite());
  EXPECT_LT((twice * x - MatrixXd::Constant(3, 1, 3.0)).norm(), 10 * kRounding) << "their mean";
}

TEST(Linear, ColumnsOfZeroSpanNothing) {
  EXPECT_EQ(basisOf(MatrixXd::Zero(3, 2)).cols(), 0);
  EXPECT_EQ(basisOf(MatrixXd(3, 0)).cols(), 0);
  const MatrixXd basis = basisOf(MatrixXd{{0.0, 3.0}, {0.0, 0.0}, {0.0, 4.0}});
  ASSERT_EQ(basis.cols(), 1);
  EXPECT_LT((basis.cwiseAbs() - MatrixXd{{0.6}, {0.0}, {0.8}}).norm(), kRounding);
}

}  // namespace
}  // namespace toftwin::linear
