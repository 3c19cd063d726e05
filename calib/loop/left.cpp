// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/left.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>


namespace toftwin::loop {

Left::Left(const Beside& beside, Eigen::Index most)
    : evidence_{&beside.evidence}, weight_{beside.weight}, y_{beside.y}, model_{beside.model} {
  if (beside.evidence.rows() > most) {
    const std::vector<Eigen::Index> rows = thinned(beside.evidence.rows(), most);
    part_ = rowsOf(beside.evidence, rows);
    evidence_ = &part_;
    weight_ = beside.weight(rows).eval(), y_ = beside.y(rows).eval(), model_ = beside.model(rows, Eigen::all).eval();
  }
  projection_.emplace(*evidence_, weight_, model_);
  left_ = (*projection_)(y_);
}

double Left::operator()(const Shape& shape) const {
  Eigen::MatrixXd x = columnsOf(*evidence_, shape.columns);
  return x.allFinite() ? after((*projection_)(std::move(x))) : before();
}

std::vector<double> Left::each(const Eigen::MatrixXd& columns, const std::vector<Shape>& shapes, double unit) const {
  constexpr std::size_t kLookedAt = 24;
  const Eigen::VectorXd weighted = left_.cwiseProduct(weight_.cwiseSqrt());
  const Eigen::VectorXd moment = columns.transpose() * weighted;
  const Eigen::VectorXd mean = columns.colwise().mean();
  std::vector<std::pair<double, std::size_t>> order;
  std::vector<Eigen::Index> from;
  Eigen::Index at = 0;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(shapes[i].columns.size());
    double with = -2.0 * static_cast<double>(k) * unit;
    for (Eigen::Index c = at; c < at + k; ++c) {
      const double size = columns.col(c).squaredNorm() - static_cast<double>(columns.rows()) * mean[c] * mean[c];
      if (size > 0.0) with += moment[c] * moment[c] / size;
    }
    order.emplace_back(k > 2 ? -std::numeric_limits<double>::infinity() : -with, i);
    from.push_back(at);
    at += k;
  }
  std::ranges::sort(order);
  std::vector<double> left(shapes.size(), before());
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    if (rank >= kLookedAt && std::isfinite(order[rank].first)) break;
    const std::size_t i = order[rank].second;
    const Eigen::MatrixXd part = columns.middleCols(from[i], static_cast<Eigen::Index>(shapes[i].columns.size()));
    if (part.allFinite()) left[i] = after((*projection_)(part));
  }
  return left;
}

Eigen::VectorXd Left::coefficients(const Eigen::MatrixXd& columns) const {
  // Of columns that are projected out the coefficients beside them are those of the projected ones [Frisch, Waugh, Lovell].
  Eigen::MatrixXd x = (*projection_)(columns);
  const Eigen::VectorXd length = x.colwise().norm().transpose().cwiseMax(1e-300);
  x = x * length.cwiseInverse().asDiagonal();
  const Eigen::VectorXd unit = pseudoInverse(x.transpose() * x) * (x.transpose() * left_);
  return unit.cwiseQuotient(length);
}

double Left::after(Eigen::MatrixXd x) const {
  for (Eigen::Index c = 0; c < x.cols(); ++c) x.col(c) /= std::max(1e-300, x.col(c).norm());
  const Eigen::VectorXd moment = x.transpose() * left_;
  return before() - moment.dot(pseudoInverse(x.transpose() * x) * moment);
}

}  // namespace toftwin::loop
