// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/clusters.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "calib/compare/fits.h"
#include "calib/compare/statistics.h"
#include "calib/linear/linear.h"

namespace toftwin::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Rows whose last column is y.
struct ClusteredRows {
  MatrixXd rows{};          ///< n × (k + 1)
  std::vector<Index> of{};  ///< each row's cluster
  Index clusters = 0;
};

ClusteredRows clusteredRowsOf(const std::vector<std::vector<double>>& columns, Column y,
                              std::span<const std::size_t> cluster) {
  const auto n = static_cast<Index>(y.size()), k = static_cast<Index>(columns.size());
  ClusteredRows all{.rows = MatrixXd(n, k + 1)};
  std::map<std::size_t, Index> numbers;
  for (const std::size_t one : cluster)
    all.of.push_back(numbers.try_emplace(one, static_cast<Index>(numbers.size())).first->second);
  all.clusters = static_cast<Index>(numbers.size());
  for (Index i = 0; i < n; ++i) {
    const auto row = static_cast<std::size_t>(i);
    for (Index c = 0; c < k; ++c) all.rows(i, c) = columns[static_cast<std::size_t>(c)][row];
    all.rows(i, k) = y[row];
  }
  return all;
}

/// Sums over rows a = (x, y), each weighed by 1/D of its own variance D relative to the mean: of all, and of
/// each cluster.
struct Weighed {
  MatrixXd squares{};  ///< Σ a aᵀ/D, (k + 1)²
  MatrixXd sums{};     ///< Σ a/D, G × (k + 1)
  VectorXd sizes{};    ///< Σ 1/D
  double log_own = 0.0;
  Index n = 0;

  Weighed(const ClusteredRows& all, const VectorXd& own) : log_own(own.array().log().sum()), n(own.size()) {
    const MatrixXd light = own.cwiseInverse().asDiagonal() * all.rows;
    squares = light.transpose() * all.rows;
    sums = MatrixXd::Zero(all.clusters, all.rows.cols()), sizes = VectorXd::Zero(all.clusters);
    for (Index i = 0; i < n; ++i) {
      const Index g = all.of[static_cast<std::size_t>(i)];
      sums.row(g) += light.row(i), sizes[g] += 1.0 / own[i];
    }
  }
  /// V = D + λ 1 1ᵀ within a cluster, so V⁻¹ = D⁻¹ − λ/(1 + λ Σ 1/D) D⁻¹ 1 1ᵀ D⁻¹: that factor.
  [[nodiscard]] VectorXd taken(double lambda) const {
    return (lambda / (1.0 + lambda * sizes.array())).matrix();
  }
};

/// What least squares makes of them for one λ.
struct Solved {
  double lambda = 0.0;
  linear::Ldlt normal{};                                   ///< Xᵀ V⁻¹ X
  VectorXd at{};
  double squares = 0.0, restricted = 0.0, deviance = 0.0;  ///< −2 ln of the likelihoods, less constants
};

Solved solvedFor(const Weighed& of, double lambda) {
  const Index k = of.squares.cols() - 1;
  const MatrixXd left = of.squares - of.sums.transpose() * of.taken(lambda).asDiagonal() * of.sums;
  Solved one{.lambda = lambda, .normal = linear::Ldlt{left.topLeftCorner(k, k)}};
  one.at = one.normal.solve(left.col(k).head(k));
  one.squares = left(k, k) - left.col(k).head(k).dot(one.at);
  const double log_spread = of.log_own + (1.0 + lambda * of.sizes.array()).log().sum(),
               log_squares = std::log(one.squares);
  one.deviance = log_spread + static_cast<double>(of.n) * log_squares;
  one.restricted = log_spread + one.normal.pivots().cwiseAbs().array().log().sum() +
                   static_cast<double>(of.n - k) * log_squares;
  return one;
}

/// With REML's λ.
Solved solved(const Weighed& of) {
  Solved without = solvedFor(of, 0.0);
  if (!(without.squares > 0.0)) return without;
  const double at = minimum1d([&](double ln) { return solvedFor(of, std::exp(ln)).restricted; },
                              std::log(1e-5), std::log(1e5));
  Solved with = solvedFor(of, std::exp(at));
  return with.restricted < without.restricted ? with : without;
}

/// By how much each row's D is too small: D (V⁻¹ r)² / σ² less D P, whose mean that is where D is right; r are
/// the residuals, P = V⁻¹ − V⁻¹ X (Xᵀ V⁻¹ X)⁻¹ Xᵀ V⁻¹. Sums of it over z_j are twice REML's score of γ_j.
VectorXd beyondOwn(const ClusteredRows& all, const VectorXd& own, const Weighed& of, const Solved& one) {
  const Index n = all.rows.rows(), k = one.at.size();
  const VectorXd taken = of.taken(one.lambda);
  MatrixXd v_rows = all.rows;  // V⁻¹ (X, y)
  for (Index i = 0; i < n; ++i) {
    const Index g = all.of[static_cast<std::size_t>(i)];
    v_rows.row(i) = (v_rows.row(i) - taken[g] * of.sums.row(g)) / own[i];
  }
  const auto x = v_rows.leftCols(k);
  const VectorXd rest = v_rows.col(k) - x * one.at;
  const VectorXd told = (x * one.normal.inverse()).cwiseProduct(x).rowwise().sum();
  const double variance = one.squares / static_cast<double>(n - k);
  VectorXd beyond(n);
  for (Index i = 0; i < n; ++i) {
    const double p = (1.0 - taken[all.of[static_cast<std::size_t>(i)]] / own[i]) / own[i] - told[i];
    beyond[i] = own[i] * (rest[i] * rest[i] / variance - p);
  }
  return beyond;
}

/// Of columns of length 1. The reciprocal condition alone does not see a pivot of exactly 0, as of two equal
/// columns: Eigen's solve() then leaves that column out.
bool isDetermined(const linear::Ldlt& normal) {
  constexpr double kLeast = 1e-9;
  const VectorXd pivots = normal.pivots();
  return pivots.minCoeff() > kLeast * pivots.maxCoeff() && normal.rcond() > kLeast;
}

/// What rows' own variances may go with: those of the columns that the rows tell apart, each about 0. None
/// where there are fewer than ten rows to spare for each.
MatrixXd powersIn(const RowErrors& errors, Index n, Index free) {
  constexpr Index kRowsForEach = 10;
  MatrixXd powers(n, 0);
  for (const auto& column : errors.powers_of) {
    const auto one = Eigen::Map<const VectorXd>(column.data(), n);
    MatrixXd more = powers;
    more.conservativeResize(n, powers.cols() + 1);
    more.rightCols(1) = (one.array() - one.mean()).matrix();
    const VectorXd length = more.colwise().norm();
    if (more.cols() * kRowsForEach > free || !(length.minCoeff() > 0.0)) continue;
    const MatrixXd even = more * length.cwiseInverse().asDiagonal();
    if (isDetermined(linear::Ldlt{even.transpose() * even})) powers = std::move(more);
  }
  return powers;
}

/// Rows by their own variances, on the mean 1, and what least squares makes of them.
struct OwnFit {
  VectorXd own{};
  Weighed of;
  Solved best;

  OwnFit(const ClusteredRows& all, VectorXd variances)
      : own(std::move(variances)), of(all, own), best(solved(of)) {}
};

/// Fisher's scoring from equal variances on, halved where it went too far.
OwnFit fitOwnVariances(const ClusteredRows& all, const MatrixXd& powers) {
  constexpr int kRounds = 30, kHalved = 6;
  constexpr double kMost = 1.0, kNear = 1e-3;  // of exponents: at once, and not worth a further round
  OwnFit now{all, VectorXd::Ones(all.rows.rows())};
  if (powers.cols() == 0) return now;
  const linear::Ldlt normal{powers.transpose() * powers};
  VectorXd exponents = VectorXd::Zero(powers.cols());
  for (int round = 0; round < kRounds && now.best.squares > 0.0; ++round) {
    VectorXd step = normal.solve(powers.transpose() * beyondOwn(all, now.own, now.of, now.best));
    step *= std::min(1.0, kMost / std::max(1e-300, step.cwiseAbs().maxCoeff()));
    bool is_better = false;
    for (int half = 0; half < kHalved && !is_better; ++half, step *= 0.5) {
      VectorXd tried = (powers * (exponents + step)).array().exp();
      tried /= tried.mean();
      OwnFit next{all, std::move(tried)};
      is_better = next.best.restricted < now.best.restricted;
      if (is_better) exponents += step, now = std::move(next);
    }
    if (!is_better || step.cwiseAbs().maxCoeff() < kNear) break;
  }
  return now;
}

/// Of a variance σ² C_jj + more: its parts and their degrees of freedom. u's own, ν, are by REML's expected
/// information, λ² tr (Zᵀ P Z)²: G − 1 where only a constant is fitted, and less by what of the parameters the
/// clusters' means tell. What is known besides has all; how clusters differ says nothing of it where it is the same
/// way in all of them, and so it is in the covariance as that, too.
struct Spread {
  MatrixXd more{};  ///< of the covariance, beyond REML's
  double degrees = 0.0;

  /// `known`: variance of each cluster's u, at least.
  Spread(const Weighed& of, const Solved& one, const VectorXd& known) {
    const Index k = one.at.size();
    const double free = static_cast<double>(of.n - k), variance = one.squares / free;
    const MatrixXd inverse = one.normal.inverse();
    const VectorXd kept = (1.0 + one.lambda * of.sizes.array()).inverse();
    const MatrixXd means = kept.asDiagonal() * of.sums.leftCols(k);  // Zᵀ V⁻¹ X
    const VectorXd beyond = (known.array() - one.lambda * variance).cwiseMax(0.0),
                   together = inverse * means.transpose() * known.cwiseSqrt();
    more = inverse * means.transpose() * beyond.asDiagonal() * means * inverse +
           together * together.transpose();
    degrees = free;
    if (!(one.lambda > 0.0)) return;
    const MatrixXd from_u = one.lambda * inverse * means.transpose() * means * inverse;
    MatrixXd left = -means * inverse * means.transpose();
    left.diagonal() += of.sizes.cwiseProduct(kept);
    const double of_clusters = one.lambda * one.lambda * left.squaredNorm();
    // Of the parameter that depends most on how clusters differ, the constant apart.
    for (Index j = k > 1 ? 1 : 0; j < k; ++j) {
      const double all = inverse(j, j) + more(j, j) / variance, by_u = std::min(from_u(j, j), inverse(j, j)),
                   by_rows = inverse(j, j) - by_u;
      degrees = std::min(
          degrees, all * all / (by_u * by_u / std::max(1.0, of_clusters) + by_rows * by_rows / free));
    }
  }
};

}  // namespace

std::optional<ClusterFit> fitInClusters(const std::vector<std::vector<double>>& columns, Column y,
                                        std::span<const std::size_t> cluster, const RowErrors& errors) {
  if (columns.empty() || y.size() <= columns.size() || cluster.size() != y.size()) return std::nullopt;
  ClusteredRows all = clusteredRowsOf(columns, y, cluster);
  if (all.clusters < 2) return std::nullopt;
  // Columns of length 1, so that what hangs on others shows.
  const Index n = all.rows.rows(), k = all.rows.cols() - 1;
  const VectorXd scale = all.rows.leftCols(k).colwise().norm();
  if (!all.rows.allFinite() || scale.minCoeff() <= 0.0) return std::nullopt;
  all.rows.leftCols(k) *= scale.cwiseInverse().asDiagonal();
  const auto x = all.rows.leftCols(k);
  const linear::Ldlt alike{x.transpose() * x};
  if (!isDetermined(alike)) return std::nullopt;
  // Less what rows that are all alike make of them, so that squares of residuals are no differences of large ones.
  const VectorXd first = alike.solve(x.transpose() * all.rows.col(k));
  all.rows.col(k) -= x * first;
  const auto [own, of, best] = fitOwnVariances(all, powersIn(errors, n, n - k));
  if (!(best.squares > 0.0)) return std::nullopt;
  VectorXd known = VectorXd::Zero(all.clusters);
  for (std::size_t i = 0; i < errors.shared.size(); ++i)
    known[all.of[i]] = std::max(known[all.of[i]], errors.shared[i] * errors.shared[i]);
  const Spread spread{of, best, known};
  const double free = static_cast<double>(n - k);
  const MatrixXd covariance = best.normal.inverse() * (best.squares / free) + spread.more;
  ClusterFit fit;
  fit.squares = best.squares, fit.n = y.size(), fit.degrees = spread.degrees, fit.free = free;
  fit.deviance = best.deviance;
  fit.of_cluster = best.lambda * best.squares / free;
  fit.square_degrees = free * static_cast<double>(n) / own.squaredNorm();
  for (Index a = 0; a < k; ++a) {
    fit.at.push_back((first[a] + best.at[a]) / scale[a]);
    for (Index b = 0; b < k; ++b) fit.covariance.push_back(covariance(a, b) / scale[a] / scale[b]);
  }
  return fit;
}

std::variant<ClusterSum, NoSum> sumInClusters(const std::vector<std::vector<double>>& columns, Column y,
                                              std::span<const std::size_t> cluster, std::size_t first) {
  if (columns.size() <= first || y.size() <= columns.size() || cluster.size() != y.size())
    return NoSum::FewRows;
  ClusteredRows all = clusteredRowsOf(columns, y, cluster);
  const Index n = all.rows.rows(), k = all.rows.cols() - 1, clusters = all.clusters;
  // Columns of length 1, so that what hangs on others shows.
  const VectorXd scale = all.rows.leftCols(k).colwise().norm();
  if (!all.rows.allFinite()) return NoSum::FewRows;
  if (scale.minCoeff() <= 0.0) return NoSum::EmptyColumn;
  const MatrixXd x = all.rows.leftCols(k) * scale.cwiseInverse().asDiagonal();
  const linear::Ldlt normal{x.transpose() * x};
  if (!isDetermined(normal)) return NoSum::ColumnsAlike;
  VectorXd of = scale.cwiseInverse();
  of.head(static_cast<Index>(first)).setZero();
  const VectorXd at = normal.solve(x.transpose() * all.rows.col(k)), rest = all.rows.col(k) - x * at,
                 weights = x * normal.solve(of);  // the sum is weights · y
  // Each cluster's part of the sum's error, weights_g · e_g; of residuals it is z_g · e.
  MatrixXd z = MatrixXd::Zero(n, clusters);
  for (Index i = 0; i < n; ++i) z(i, all.of[static_cast<std::size_t>(i)]) = weights[i];
  const VectorXd part = z.transpose() * rest, own = z.colwise().squaredNorm();
  z -= x * normal.solveEach(x.transpose() * z);
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
