// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/held_out.h"

#include <algorithm>
#include <cmath>

#include "calib/linear/linear.h"
#include "calib/loop/projection.h"
#include "calib/loop/wander.h"

namespace toftwin::loop {
namespace {

constexpr int kFolds = 10;
/// Where a row's loss turns from a square into a line.
constexpr double kHuber = 2.0;

double lossOf(double z) {
  const double size = std::abs(z);
  return size < kHuber ? 0.5 * size * size : kHuber * (size - 0.5 * kHuber);
}

}  // namespace

HeldOut::Gain HeldOut::over(const HeldOut& worse) const {
  const Eigen::VectorXd gain = worse.loss - loss;
  const auto blocks = static_cast<double>(gain.size());
  const double spread = std::sqrt((gain.array() - gain.mean()).square().sum() / std::max(1.0, blocks - 1.0));
  return {gain.sum(), spread * std::sqrt(blocks)};
}

Folds::Folds(const Evidence& evidence, const Eigen::VectorXd& y, const Eigen::VectorXd& weight, double scale)
    : evidence_{evidence}, root_weight_{weight.cwiseSqrt()}, shared_(y.size(), 0), scale_{scale} {
  const Projection offsets{evidence, weight, Eigen::MatrixXd(y.size(), 0)};
  y_ = offsets(y);
  for (const int block : evidence.block) fold_.push_back(block % std::min(kFolds, std::max(2, evidence.blocks)));
}

Eigen::MatrixXd Folds::prepared(const Eigen::MatrixXd& columns) const {
  const Projection offsets{evidence_, root_weight_.cwiseAbs2(), Eigen::MatrixXd(y_.size(), 0)};
  Eigen::MatrixXd x = offsets(columns);
  for (Eigen::Index c = 0; c < x.cols(); ++c) x.col(c) /= std::max(1e-300, x.col(c).norm());
  return x;
}

void Folds::share(const Eigen::MatrixXd& shared) { shared_ = prepared(shared); }

HeldOut Folds::with(const Eigen::MatrixXd& more) const {
  Eigen::MatrixXd x(y_.size(), shared_.cols() + more.cols());
  x << shared_, prepared(more);
  const auto k = x.cols();
  const int folds = 1 + *std::ranges::max_element(fold_);
  std::vector<Eigen::MatrixXd> gram(static_cast<std::size_t>(folds), Eigen::MatrixXd::Zero(k, k));
  std::vector<Eigen::VectorXd> moment(static_cast<std::size_t>(folds), Eigen::VectorXd::Zero(k));
  std::vector<std::vector<Eigen::Index>> rows(static_cast<std::size_t>(folds));
  for (Eigen::Index i = 0; i < y_.size(); ++i) rows[static_cast<std::size_t>(fold_[static_cast<std::size_t>(i)])].push_back(i);
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(k, k);
  Eigen::VectorXd all_moment = Eigen::VectorXd::Zero(k);
  for (std::size_t f = 0; f < rows.size() && k > 0; ++f) {
    const Eigen::MatrixXd part = x(rows[f], Eigen::all);
    gram[f].noalias() = part.transpose() * part;
    moment[f].noalias() = part.transpose() * y_(rows[f]);
    all += gram[f], all_moment += moment[f];
  }
  HeldOut held{Eigen::VectorXd::Zero(evidence_.blocks), Eigen::VectorXd(y_.size())};
  for (std::size_t f = 0; f < rows.size(); ++f) {
    Eigen::VectorXd coefficient(k);
    if (k > 0) {
      // The least ridge keeps columns that only this fold's rows show from growing beyond bounds.
      const Eigen::MatrixXd ridge = 1e-9 * Eigen::MatrixXd::Identity(k, k);
      coefficient = linear::Ldlt{all - gram[f] + ridge}.solve(all_moment - moment[f]);
    }
    for (const Eigen::Index i : rows[f]) {
      const double left = k > 0 ? y_[i] - x.row(i).dot(coefficient) : y_[i];
      // Rows are in units of sigma where the weight is 1/sigma²; robust weights are taken out again.
      held.left[i] = left / (root_weight_[i] * evidence_.sigma[i]) / scale_;
      held.loss[evidence_.block[static_cast<std::size_t>(i)]] += lossOf(held.left[i]);
    }
  }
  return held;
}

HeldOut Folds::wandering(const HeldOut& held) const {
  // Few far rows must not decide how slowly all of them go.
  const Eigen::VectorXd cut = held.left.cwiseMin(4.0).cwiseMax(-4.0);
  const Wander wander = fitWander(cut, evidence_.group);
  HeldOut out{Eigen::VectorXd::Zero(evidence_.blocks), held.left - predictBlocks(cut, evidence_.group, evidence_.block, wander)};
  for (Eigen::Index i = 0; i < out.left.size(); ++i) out.loss[evidence_.block[static_cast<std::size_t>(i)]] += lossOf(out.left[i]);
  return out;
}

}  // namespace toftwin::loop
