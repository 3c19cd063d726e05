// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/projection.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/linear/linear.h"

namespace toftwin::loop {
namespace {

/// Beyond so many deviations a row counts less; efficient to 99 % for a normal distribution.
constexpr double kHuber = 2.0;
constexpr double kMadOfNormal = 1.4826;

}  // namespace

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

double spreadOf(const Eigen::VectorXd& values) { return std::sqrt((values.array() - values.mean()).square().mean()); }

Eigen::MatrixXd sideBySide(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd both(a.rows(), a.cols() + b.cols());
  both << a, b;
  return both;
}

double robustScale(std::vector<double> values) {
  for (double& value : values) value = std::abs(value);
  return kMadOfNormal * median(std::move(values));
}
double robustScale(const Eigen::VectorXd& residual) {
  return robustScale(std::vector<double>(residual.begin(), residual.end()));
}

Eigen::VectorXd robustWeights(const Eigen::VectorXd& residual, const Eigen::VectorXd& sigma) {
  const Eigen::VectorXd z = residual.cwiseQuotient(sigma);
  const double scale = robustScale(z);
  Eigen::VectorXd weight = sigma.array().square().inverse();
  if (!(scale > 0.0)) return weight;
  for (Eigen::Index i = 0; i < z.size(); ++i) weight[i] *= std::min(1.0, kHuber * scale / std::max(1e-300, std::abs(z[i])));
  return weight;
}

Projection::Projection(const Evidence& evidence, const Eigen::VectorXd& weight, const Eigen::MatrixXd& model)
    : root_weight_{weight.cwiseSqrt()}, group_{evidence.group} {
  sums_.assign(static_cast<std::size_t>(std::max(1, evidence.groups())), 0.0);
  for (Eigen::Index i = 0; i < weight.size(); ++i) sums_[static_cast<std::size_t>(group_[static_cast<std::size_t>(i)])] += weight[i];
  if (model.cols() == 0) {
    basis_.resize(weight.size(), 0);
    return;
  }
  Eigen::MatrixXd scaled = root_weight_.asDiagonal() * model;
  takeOffsets(scaled);
  basis_ = linear::basisOf(std::move(scaled));
}

void Projection::takeOffsets(Eigen::MatrixXd& scaled) const {
  if (sums_.size() == 1) {
    const Eigen::RowVectorXd mean = (root_weight_.transpose() * scaled) / std::max(1e-300, sums_.front());
    scaled.noalias() -= root_weight_ * mean;
    return;
  }
  std::vector<double> sum(sums_.size());
  for (Eigen::Index c = 0; c < scaled.cols(); ++c) {
    std::ranges::fill(sum, 0.0);
    for (Eigen::Index i = 0; i < scaled.rows(); ++i)
      sum[static_cast<std::size_t>(group_[static_cast<std::size_t>(i)])] += root_weight_[i] * scaled(i, c);
    for (std::size_t g = 0; g < sum.size(); ++g) sum[g] /= std::max(1e-300, sums_[g]);
    for (Eigen::Index i = 0; i < scaled.rows(); ++i)
      scaled(i, c) -= root_weight_[i] * sum[static_cast<std::size_t>(group_[static_cast<std::size_t>(i)])];
  }
}

Eigen::MatrixXd Projection::operator()(Eigen::MatrixXd columns) const {
  columns = root_weight_.asDiagonal() * columns;
  takeOffsets(columns);
  if (basis_.cols() > 0) columns -= basis_ * (basis_.transpose() * columns).eval();
  return columns;
}

Eigen::MatrixXd pseudoInverse(const Eigen::MatrixXd& gram) {
  constexpr double kLeast = 1e-11;
  const auto pairs = linear::eigenpairs(gram);
  const double least = kLeast * std::max(1e-300, pairs.values.maxCoeff());
  const Eigen::VectorXd inverse = pairs.values.unaryExpr([&](double v) { return v > least ? 1.0 / v : 0.0; });
  return pairs.vectors * inverse.asDiagonal() * pairs.vectors.transpose();
}

LeastSquares leastSquares(const Evidence& evidence, const Eigen::VectorXd& y, const Eigen::VectorXd& weight,
                          const Eigen::MatrixXd& columns) {
  const Projection offsets{evidence, weight, Eigen::MatrixXd(y.size(), 0)};
  const Eigen::MatrixXd left = offsets(y), x = offsets(columns);
  LeastSquares fit;
  Eigen::MatrixXd scaled = left;
  if (columns.cols() > 0) {
    // Columns are scaled to length 1, so that a small unit does not look like a column that adds nothing.
    // One of which the offsets leave nothing but rounding has no coefficient.
    const Eigen::VectorXd whole = (weight.cwiseSqrt().asDiagonal() * columns).colwise().norm();
    Eigen::VectorXd length = x.colwise().norm();
    for (Eigen::Index c = 0; c < length.size(); ++c)
      if (!(length[c] > 1e-10 * whole[c])) length[c] = std::numeric_limits<double>::infinity();
    const Eigen::MatrixXd unit = x * length.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd information = pseudoInverse(unit.transpose() * unit);
    fit.coefficient = length.cwiseInverse().asDiagonal() * (information * (unit.transpose() * left));
    fit.covariance = length.cwiseInverse().asDiagonal() * information * length.cwiseInverse().asDiagonal();
    scaled -= x * fit.coefficient;
  } else {
    fit.coefficient.resize(0), fit.covariance.resize(0, 0);
  }
  fit.residual = scaled.col(0).cwiseQuotient(weight.cwiseSqrt());
  return fit;
}

LeastSquares robustLeastSquares(const Evidence& evidence, const Eigen::VectorXd& y, const Eigen::MatrixXd& columns) {
  LeastSquares fit = leastSquares(evidence, y, evidence.sigma.array().square().inverse(), columns);
  for (int turn = 0; turn < 6; ++turn) fit = leastSquares(evidence, y, robustWeights(fit.residual, evidence.sigma), columns);
  return fit;
}

}  // namespace toftwin::loop
