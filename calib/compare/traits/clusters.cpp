// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/clusters.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "calib/compare/fits.h"
#include "calib/compare/statistics.h"

namespace toftwin::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Rows whose last column is y, and the means of each cluster.
struct ClusteredRows {
  MatrixXd rows{}, means{};    ///< n × (k + 1), G × (k + 1)
  std::vector<Index> of{};     ///< each row's cluster
  std::vector<double> size{};  ///< of each cluster
};

ClusteredRows clusteredRowsOf(const std::vector<std::vector<double>>& columns, Column y,
                              std::span<const std::size_t> cluster) {
  const auto n = static_cast<Index>(y.size()), k = static_cast<Index>(columns.size());
  ClusteredRows all{.rows = MatrixXd(n, k + 1)};
  std::map<std::size_t, Index> numbers;
  for (const std::size_t one : cluster)
    all.of.push_back(numbers.try_emplace(one, static_cast<Index>(numbers.size())).first->second);
  all.size.assign(numbers.size(), 0.0);
  all.means = MatrixXd::Zero(static_cast<Index>(numbers.size()), k + 1);
  for (Index i = 0; i < n; ++i) {
    const auto row = static_cast<std::size_t>(i);
    for (Index c = 0; c < k; ++c) all.rows(i, c) = columns[static_cast<std::size_t>(c)][row];
    all.rows(i, k) = y[row];
    all.means.row(all.of[row]) += all.rows.row(i);
    ++all.size[static_cast<std::size_t>(all.of[row])];
  }
  for (std::size_t g = 0; g < all.size.size(); ++g) all.means.row(static_cast<Index>(g)) /= all.size[g];
  return all;
}

/// What least squares makes of the rows transformed for one λ.
struct Transformed {
  Eigen::LDLT<MatrixXd> normal{};
  VectorXd at{};
  double squares = 0.0, restricted = 0.0;  ///< −2 ln of the restricted likelihood, less constants
};

Transformed transformed(const ClusteredRows& all, double lambda) {
  const Index n = all.rows.rows(), k = all.rows.cols() - 1;
  MatrixXd rows = all.rows;
  double log_volume = 0.0;
  for (const double size : all.size) log_volume += std::log1p(lambda * size);
  for (Index i = 0; i < n; ++i) {
    const Index g = all.of[static_cast<std::size_t>(i)];
    rows.row(i) -=
        (1.0 - 1.0 / std::sqrt(1.0 + lambda * all.size[static_cast<std::size_t>(g)])) * all.means.row(g);
  }
  const auto x = rows.leftCols(k);
  Transformed one{.normal = Eigen::LDLT<MatrixXd>{x.transpose() * x}};
  one.at = one.normal.solve(x.transpose() * rows.col(k));
  one.squares = (rows.col(k) - x * one.at).squaredNorm();
  one.restricted = log_volume + one.normal.vectorD().cwiseAbs().array().log().sum() +
                   static_cast<double>(n - k) * std::log(one.squares);
  return one;
}

/// Satterthwaite's degrees of freedom of the parameter that depends most on how clusters differ, the constant
/// apart: of a variance whose share s comes from u, (s²/ν + (1 − s)²/(n − k))⁻¹. ν is of u's own variance by
/// REML's expected information, λ² tr (Zᵀ P Z)², with P what the parameters leave of V⁻¹: G − 1 where only a
/// constant is fitted, and less by what of the parameters the clusters' means tell.
double degreesOf(const ClusteredRows& all, const MatrixXd& inverse, double lambda, double free) {
  const Index k = inverse.cols();
  MatrixXd means = all.means.leftCols(k);
  for (Index g = 0; g < means.rows(); ++g) {
    const double size = all.size[static_cast<std::size_t>(g)];
    means.row(g) *= size / (1.0 + lambda * size);
  }
  const MatrixXd from_u = lambda * inverse * means.transpose() * means * inverse;
  MatrixXd left = -means * inverse * means.transpose();
  for (Index g = 0; g < means.rows(); ++g) {
    const double size = all.size[static_cast<std::size_t>(g)];
    left(g, g) += size / (1.0 + lambda * size);
  }
  const double clusters = std::max(1.0, lambda * lambda * left.squaredNorm());
  double least = free;
  for (Index j = k > 1 ? 1 : 0; j < k; ++j) {
    const double share = std::clamp(from_u(j, j) / inverse(j, j), 0.0, 1.0);
    least = std::min(least, 1.0 / (share * share / clusters + (1.0 - share) * (1.0 - share) / free));
  }
  return least;
}

/// Of columns of length 1. The reciprocal condition alone does not see a pivot of exactly 0, as of two equal
/// columns: Eigen's solve() then leaves that column out.
bool isDetermined(const Eigen::LDLT<MatrixXd>& normal) {
  constexpr double kLeast = 1e-9;
  const auto pivots = normal.vectorD();
  return pivots.minCoeff() > kLeast * pivots.maxCoeff() && normal.rcond() > kLeast;
}

}  // namespace

std::optional<Fit> fitInClusters(const std::vector<std::vector<double>>& columns, Column y,
                                 std::span<const std::size_t> cluster) {
  if (columns.empty() || y.size() <= columns.size() || cluster.size() != y.size()) return std::nullopt;
  ClusteredRows all = clusteredRowsOf(columns, y, cluster);
  if (all.size.size() < 2) return std::nullopt;
  // Columns of length 1, so that what hangs on others shows.
  const Index k = all.rows.cols() - 1;
  const VectorXd scale = all.rows.leftCols(k).colwise().norm();
  if (!all.rows.allFinite() || scale.minCoeff() <= 0.0) return std::nullopt;
  all.rows.leftCols(k) *= scale.cwiseInverse().asDiagonal();
  all.means.leftCols(k) *= scale.cwiseInverse().asDiagonal();
  const Transformed without = transformed(all, 0.0);
  if (!isDetermined(without.normal) || !(without.squares > 0.0)) return std::nullopt;
  const double at =
      minimum1d([&](double log_lambda) { return transformed(all, std::exp(log_lambda)).restricted; },
                std::log(1e-5), std::log(1e5));
  const Transformed with = transformed(all, std::exp(at));
  const bool has_shared = with.restricted < without.restricted;
  const Transformed& best = has_shared ? with : without;
  const double free = static_cast<double>(y.size()) - static_cast<double>(k);
  const MatrixXd inverse = best.normal.solve(MatrixXd::Identity(k, k));
  const MatrixXd covariance = inverse * (best.squares / free);
  Fit fit{.squares = best.squares,
          .n = y.size(),
          .degrees = has_shared ? degreesOf(all, inverse, std::exp(at), free) : free};
  for (Index a = 0; a < k; ++a) {
    fit.at.push_back(best.at[a] / scale[a]);
    for (Index b = 0; b < k; ++b) fit.covariance.push_back(covariance(a, b) / scale[a] / scale[b]);
  }
  return fit;
}

std::variant<ClusterSum, NoSum> sumInClusters(const std::vector<std::vector<double>>& columns, Column y,
                                              std::span<const std::size_t> cluster, std::size_t first) {
  if (columns.size() <= first || y.size() <= columns.size() || cluster.size() != y.size())
    return NoSum::FewRows;
  ClusteredRows all = clusteredRowsOf(columns, y, cluster);
  const Index n = all.rows.rows(), k = all.rows.cols() - 1, clusters = all.means.rows();
  // Columns of length 1, so that what hangs on others shows.
  const VectorXd scale = all.rows.leftCols(k).colwise().norm();
  if (!all.rows.allFinite()) return NoSum::FewRows;
  if (scale.minCoeff() <= 0.0) return NoSum::EmptyColumn;
  const MatrixXd x = all.rows.leftCols(k) * scale.cwiseInverse().asDiagonal();
  const Eigen::LDLT<MatrixXd> normal{x.transpose() * x};
  if (!isDetermined(normal)) return NoSum::ColumnsAlike;
  VectorXd of = scale.cwiseInverse();
  of.head(static_cast<Index>(first)).setZero();
  const VectorXd at = normal.solve(x.transpose() * all.rows.col(k)), rest = all.rows.col(k) - x * at,
                 weights = x * normal.solve(of);  // the sum is weights · y
  // Each cluster's part of the sum's error, weights_g · e_g; of residuals it is z_g · e.
  MatrixXd z = MatrixXd::Zero(n, clusters);
  for (Index i = 0; i < n; ++i) z(i, all.of[static_cast<std::size_t>(i)]) = weights[i];
  const VectorXd part = z.transpose() * rest, own = z.colwise().squaredNorm();
  z -= x * normal.solve(x.transpose() * z);
  const MatrixXd seen = z.transpose() * z;
  if (!(seen.diagonal().array() > 1e-9 * own.array()).all()) return NoSum::OneCluster;
  const VectorXd more = own.cwiseQuotient(seen.diagonal());
  const double spread = (more * more.transpose()).cwiseProduct(seen.cwiseAbs2()).sum();
  return ClusterSum{.value = of.dot(at),
                    .error = std::sqrt(more.dot(part.cwiseAbs2())),
                    .degrees = own.sum() * own.sum() / spread};
}

std::vector<double> clusterMeans(Column values, std::span<const std::size_t> cluster) {
  std::map<std::size_t, Running> all;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i])) all[cluster[i]].add(values[i]);
  }
  std::vector<double> means;
  for (const auto& [number, one] : all) means.push_back(one.mean());
  return means;
}

}  // namespace toftwin::compare
