// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/decay_grid.h"

#include <algorithm>
#include <cmath>

#include "calib/linear/linear.h"

namespace toftwin::compare {

double decay(double t, double log_tau) { return std::exp(-t / std::exp(log_tau)); }

double shortestDecay(Column t) { return 0.5 * (t[1] - t[0]); }

DecayGrid::DecayGrid(Column t, Column y) {
  constexpr double kRatio = 1.25;
  for (double tau = std::max(shortestDecay(t), 1e-4); tau < kLongestDecay; tau *= kRatio)
    log_taus_.push_back(std::log(tau));
  MatrixXd basis(static_cast<Eigen::Index>(t.size()), static_cast<Eigen::Index>(log_taus_.size()) + 1);
  for (Eigen::Index i = 0; i < basis.rows(); ++i) {
    basis(i, 0) = 1.0;
    for (std::size_t k = 0; k < log_taus_.size(); ++k)
      basis(i, static_cast<Eigen::Index>(k) + 1) = decay(t[static_cast<std::size_t>(i)], log_taus_[k]);
  }
  products_ = basis.transpose() * basis;
  with_y_ = basis.transpose() * Eigen::Map<const VectorXd>(y.data(), basis.rows());
}

std::vector<double> DecayGrid::one() const {
  std::vector<double> best(3, 0.0);
  double most = -1.0;
  for (std::size_t k = 1; k <= log_taus_.size(); ++k) keepBetter({0, k}, most, best);
  return best;
}

std::vector<double> DecayGrid::two() const {
  std::vector<double> best(5, 0.0);
  double most = -1.0;
  for (std::size_t k = 1; k <= log_taus_.size(); ++k)
    for (std::size_t l = k + 1; l <= log_taus_.size(); ++l) keepBetter({0, k, l}, most, best);
  return best;
}

void DecayGrid::keepBetter(const std::vector<std::size_t>& columns, double& most, std::vector<double>& best) const {
  const VectorXd right = with_y_(columns), x = linear::Ldlt{products_(columns, columns)}.solve(right);
  const double explained = x.dot(right);
  if (!x.allFinite() || !(explained > most)) return;
  most = explained;
  best = {x[0]};
  for (std::size_t k = 1; k < columns.size(); ++k)
    best.insert(best.end(), {x[static_cast<Eigen::Index>(k)], log_taus_[columns[k] - 1]});
}

}  // namespace toftwin::compare
