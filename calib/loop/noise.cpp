// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/noise.h"

#include <algorithm>
#include <cmath>

#include <boost/math/distributions/fisher_f.hpp>

#include "calib/loop/grammar.h"
#include "calib/loop/projection.h"

namespace toftwin::loop {
namespace {

/// Blocks are no longer than a twentieth of the rows: fewer than twenty blocks tell nothing.
constexpr Eigen::Index kFewestBlocks = 16;

/// The lag from which on the correlation of neighbours of one group is within twice its error.
Eigen::Index lengthOf(const Evidence& evidence, const Eigen::VectorXd& z, double& first) {
  const Eigen::Index most = std::max<Eigen::Index>(1, z.size() / kFewestBlocks);
  first = 0.0;
  for (Eigen::Index lag = 1; lag <= most; ++lag) {
    double together = 0.0, size = 0.0;
    Eigen::Index count = 0;
    for (Eigen::Index i = 0; i + lag < z.size(); ++i) {
      if (evidence.group[static_cast<std::size_t>(i)] != evidence.group[static_cast<std::size_t>(i + lag)]) continue;
      together += z[i] * z[i + lag], size += 0.5 * (z[i] * z[i] + z[i + lag] * z[i + lag]), ++count;
    }
    if (count < 8) return lag;
    const double correlation = together / std::max(1e-300, size);
    if (lag == 1) first = correlation;
    if (correlation < 2.0 / std::sqrt(static_cast<double>(count))) return lag;
  }
  return most;
}

}  // namespace

Eigen::MatrixXd flexibleColumns(const Evidence& evidence) {
  std::vector<Product> products;
  const auto most = static_cast<std::size_t>(evidence.rows() / 10);
  for (const Family& family : families()) {
    if (family.name != "curve" && family.name != "levels") continue;
    for (const Covariate& c : evidence.covariates) {
      if (c.is_group_name) continue;
      const Covariate* argument = &c;
      const Arguments arguments{&argument, 1};
      if (!family.applies(arguments)) continue;
      const double knots = std::clamp(static_cast<double>(most) / (1.0 + static_cast<double>(evidence.covariates.size())), 3.0, 9.0);
      auto more = family.make(arguments, {std::floor(knots)});
      if (products.size() + more.size() > most) continue;
      products.insert(products.end(), more.begin(), more.end());
    }
  }
  return columnsOf(evidence, products);
}

Eigen::MatrixXd flexibleWithinGroups(const Evidence& evidence) {
  Evidence within = evidence;
  std::erase_if(within.covariates, [](const Covariate& c) { return !c.varies_within_groups; });
  return flexibleColumns(within);
}

Noise judgeNoise(const Evidence& evidence, const Eigen::MatrixXd& model) {
  const Eigen::MatrixXd flexible = flexibleColumns(evidence);
  Eigen::MatrixXd all(evidence.rows(), model.cols() + flexible.cols());
  all << model, flexible;
  const LeastSquares fit = robustLeastSquares(evidence, evidence.y, all);
  Noise noise{.residual = fit.residual};
  Eigen::VectorXd z = fit.residual.cwiseQuotient(evidence.sigma);
  const double freedom = static_cast<double>(evidence.rows()) / std::max(1.0, static_cast<double>(evidence.rows() - all.cols()));
  noise.scale = std::max(1e-300, robustScale(z) * std::sqrt(freedom));
  // Few far rows must not decide how rows go together.
  z = (z / noise.scale).cwiseMin(3.0).cwiseMax(-3.0);
  noise.length = lengthOf(evidence, z, noise.correlation);
  return noise;
}

double chanceOfGroups(const Evidence& evidence, const Eigen::MatrixXd& model) {
  if (evidence.groups() < 2) return 1.0;
  const LeastSquares with = robustLeastSquares(evidence, evidence.y, model);
  const LeastSquares without = robustLeastSquares(ungrouped(evidence), evidence.y, model);
  const auto squares = [&](const Eigen::VectorXd& residual) {
    const double scale = robustScale(Eigen::VectorXd(with.residual.cwiseQuotient(evidence.sigma)));
    return residual.cwiseQuotient(evidence.sigma).cwiseAbs2().cwiseMin(9.0 * scale * scale).sum();
  };
  const double k = evidence.groups() - 1;
  const double freedom = std::max(1.0, static_cast<double>(evidence.rows() - evidence.groups() - model.cols()));
  const double left = squares(with.residual), more = std::max(0.0, squares(without.residual) - left);
  if (!(left > 0.0)) return 0.0;
  return boost::math::cdf(boost::math::complement(boost::math::fisher_f{k, freedom}, (more / k) / (left / freedom)));
}

Evidence ungrouped(Evidence evidence) {
  std::ranges::fill(evidence.group, 0);
  evidence.group_names = {""};
  return evidence;
}

}  // namespace toftwin::loop
