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

}  // namespace
}  // namespace toftwin::linear
