// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/telling/removed.h"

#include <algorithm>
#include <cmath>

#include <boost/math/distributions/students_t.hpp>

#include "calib/loop/noise.h"
#include "calib/loop/projection.h"

namespace toftwin::loop {
namespace {

/// The noise's mean square, and the variance of that. Tails count, since they are in the errors' squares, too.
struct MeanSquare {
  double value = 0.0, variance = 0.0;
};
MeanSquare noiseOf(const Evidence& open, const std::vector<Effect>& effects) {
  const Eigen::MatrixXd columns = sideBySide(columnsOf(open, effects), flexibleColumns(open));
  const Eigen::VectorXd square = leastSquares(open, open.y, Eigen::VectorXd::Ones(open.rows()), columns).residual.cwiseAbs2();
  const double freedom = std::max(1.0, static_cast<double>(open.rows() - columns.cols() - open.groups()));
  MeanSquare noise{.value = square.sum() / freedom};
  noise.variance = (square.array() - square.mean()).square().sum() / (freedom * freedom);
  return noise;
}

}  // namespace

Removed removedOf(const Evidence& open, const std::vector<Effect>& effects, const TableEvidence& locked, const Model& model, Eigen::Index length) {
  const Eigen::Index n = locked.evidence.rows();
  if (n < 8) return {};
  const MeanSquare noise = noiseOf(open, effects);
  const Eigen::VectorXd before = open.y - predicted(open, termsOf(model));
  // The constant is the open rows': of locked ones it would be fitted to what judges.
  const Eigen::VectorXd e = locked.evidence.y.array() - open.y.mean();
  const Eigen::VectorXd left = (locked.evidence.y - predicted(locked.evidence, termsOf(model))).array() - (locked.hasTruth() ? 0.0 : before.mean());
  const Eigen::VectorXd taken = e.cwiseAbs2() - left.cwiseAbs2(), there = e.array().square() - noise.value;
  const double rows = static_cast<double>(n), whole = there.mean();
  const Eigen::Index block = std::max<Eigen::Index>(1, length);
  const double blocks = std::ceil(rows / static_cast<double>(block));
  const auto errorOf = [&](const Eigen::VectorXd& values) {
    double squares = 0.0;
    for (Eigen::Index from = 0; from < n; from += block) squares += std::pow(values.segment(from, std::min(block, n - from)).sum(), 2);
    return squares / (rows * rows) * blocks / std::max(1.0, blocks - 1.0);
  };
  Removed removed{.share = taken.mean() / whole};
  const double whole_error = std::sqrt(errorOf(there.array() - whole) + noise.variance);
  removed.is_known = whole > 2.0 * whole_error && blocks >= 4.0;
  if (!removed.is_known) return {};
  const Eigen::VectorXd influence = taken - removed.share * there;
  const double error = std::sqrt(errorOf(influence) + removed.share * removed.share * noise.variance) / whole;
  const double half = error * boost::math::quantile(boost::math::complement(boost::math::students_t{blocks - 1.0}, 0.025));
  removed.low = removed.share - half, removed.high = removed.share + half;
  return removed;
}

}  // namespace toftwin::loop
