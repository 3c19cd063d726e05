// SPDX-License-Identifier: Apache-2.0
// Rows that follow each other and err alike.
#include <cmath>

#include <gmock/gmock.h>

#include "calib/discover/row_dependence.h"
#include "calib/discover/table_source.h"
#include "planted.h"

namespace toftwin::discover {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Two sessions, of which the second's rows stand before the first's in places; lines that are missing are
/// gaps.
TableData rowsWithGaps() {
  TableData data;
  data.session = {0, 0, 1, 0, 1, 1, 0};
  data.line = {2, 3, 4, 7, 8, 9, 12};
  data.error.assign(data.session.size(), 0.0);
  return data;
}

TEST(RowClock, CountsLinesWithinASessionAndLeavesGapsWhereRowsAreMissing) {
  const auto clocks = clocksOf(rowsWithGaps());
  ASSERT_EQ(clocks.size(), 1u);
  EXPECT_THAT(clocks[0].order, testing::ElementsAre(0, 1, 3, 6, 2, 4, 5));
  const double median = 4.0;  // of 1, 4, 5, 4, 1
  EXPECT_THAT(clocks[0].step, testing::ElementsAre(INFINITY, 1 / median, 4 / median, 5 / median, INFINITY,
                                                   4 / median, 1 / median));
}

TEST(RowClock, FollowsACovariateThatIsATime) {
  TableData data = rowsWithGaps();
  data.covariates = {{"temperature_c", Nature::Plain, {7, 6, 5, 4, 3, 2, 1}},
                     {"time_s", Nature::Time, {30, 20, 5, 10, 6, 7, 0}}};
  const auto clocks = clocksOf(data);
  ASSERT_EQ(clocks.size(), 2u);
  EXPECT_EQ(clocks[1].name, "time_s");
  EXPECT_THAT(clocks[1].order, testing::ElementsAre(6, 3, 1, 0, 2, 4, 5));
}

/// L⁻¹ Σ L⁻ᵀ = 1 and ln det Σ, for Σ = (1 − q) + q ρ^|Δ| of rows of one session.
TEST(RowWhitening, IsTheRootOfTheInverseCorrelation) {
  const TableData data = rowsWithGaps();
  const RowCorrelation correlation{0.7, 0.8};
  const auto n = static_cast<Index>(data.rows());
  MatrixXd sigma = MatrixXd::Identity(n, n) * (1.0 - correlation.share);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
      if (data.session[a] != data.session[b]) continue;
      const double steps =
          std::abs(static_cast<double>(data.line[a]) - static_cast<double>(data.line[b])) / 4.0;
      sigma(i, j) += correlation.share * std::pow(correlation.neighbour, steps);
    }
  }
  const RowWhitening whitening{clocksOf(data)[0], correlation};
  const MatrixXd inverse = whitening.whitened(MatrixXd::Identity(n, n));
  EXPECT_LT((inverse * sigma * inverse.transpose() - MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_NEAR(whitening.logDeterminant(), std::log(sigma.determinant()), 1e-12);
  EXPECT_LT((whitening.coloured(inverse) - MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-12);
}

/// The spectrum at nothing over the variance, (σ² + 19 s²)/(σ² + s²), is 10 for ρ = 0.9, white σ = 1 and
/// AR(1) s = 1. White noise is taken for it in one table of a hundred and each of two clocks: more than two
/// of twenty have probability 0.7 %.
TEST(DependenceOf, SeesThatNeighboursErrAlikeAndNotThatTheyDoNot) {
  int seen = 0, imagined = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const TableSource white{plant(seed, {Hidden::Nothing}, 0.0).data, true};
    const TableSource alike{plant(seed, {Hidden::Nothing}, 0.0, {.ar1_mm = 1.0}).data, true};
    imagined += white.noise().dependence->isClear();
    seen += alike.noise().correlationRows() > 3.0;
  }
  EXPECT_LE(imagined, 2) << "of twenty tables of white noise";
  EXPECT_GE(seen, 18) << "of twenty tables with correlated noise";
}

/// Over distances in random order a wave is white.
TEST(DependenceOf, AWaveIsNoCorrelation) {
  const TableSource source{plant(3, {Hidden::Wiggle}, 3000.0).data, true};
  EXPECT_FALSE(source.noise().dependence->isClear());
}

TEST(DependenceOf, IsNotAskedForWhereCapturesSayIt) {
  const TableSource source{plant(3, {Hidden::Nothing}, 0.0, {.captures = 24, .capture_mm = 3.0}).data, true};
  EXPECT_FALSE(source.noise().dependence);
}

}  // namespace
}  // namespace toftwin::discover
