// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {

/// What is known of how rows in clusters err, besides what they show themselves.
struct RowErrors {
  /// Natural logarithms of what a row's own variance may go with as a power, such as the distance and the
  /// number of pixels it is the mean of; empty: all rows are alike.
  std::vector<std::vector<double>> powers_of{};
  /// Of each row, what its cluster shares has this standard error, at least, and may have it the same way in
  /// all clusters, as poses of one board by one lens; empty: it is not known.
  std::vector<double> shared{};
};

/// A fit of rows in clusters.
struct ClusterFit : Fit {
  double square_degrees = 0.0;  ///< of the rows' mean square: fewer than n − k where few rows scatter most
  double of_cluster = 0.0;  ///< variance of what a cluster shares
};

/// y = Σ p_k column_k + u_c + e: rows of one cluster, such as the steps of one capture, share an error u_c
/// besides their own (one-way random effects), and a row's own variance is σ² Π z_j^γ_j of what it may go with
/// (A. C. Harvey, Econometrica 44 (1976) 461). The exponents γ and the ratio λ of u's variance to the rows'
/// mean one are REML's (H. D. Patterson, R. Thompson, Biometrika 58 (1971) 545). Where u's is known to be
/// larger than that, it is by so much more in the covariance, and once more as if it were the same way in all.
/// The degrees of freedom are Satterthwaite's, between those of u, G − 1 or less for G clusters, and n − k. The
/// first column is the constant. `squares` are those of the rows, each beside its own variance, over n − k the
/// rows' mean variance. Nothing if n ≤ k, for fewer than two clusters, or if the rows leave a parameter
/// undetermined.
std::optional<ClusterFit> fitInClusters(const std::vector<std::vector<double>>& columns, Column y,
                                        std::span<const std::size_t> cluster, const RowErrors& errors = {});

/// Least squares of all rows alike, and the sum of its parameters from `first` on, whose error is by how
/// clusters scatter: each cluster's part of it from its residuals, enlarged by what fitting takes from
/// residuals of independent rows, with Satterthwaite's degrees of freedom (R. M. Bell, D. F. McCaffrey, Surv.
/// Methodol. 28 (2002) 169, for one number).
struct ClusterSum {
  double value = 0.0, error = 0.0, degrees = 0.0;
};
/// Why rows do not tell it: n ≤ k or a value that is not finite; a column of zeros; columns of which one
/// hangs on the others; one cluster alone determines the sum, so that nothing says how clusters differ.
enum class NoSum { FewRows, EmptyColumn, ColumnsAlike, OneCluster };
std::variant<ClusterSum, NoSum> sumInClusters(const std::vector<std::vector<double>>& columns, Column y,
                                              std::span<const std::size_t> cluster, std::size_t first);

/// Mean of each cluster's values, by ascending cluster; values that are not finite are left out.
std::vector<double> clusterMeans(Column values, std::span<const std::size_t> cluster);

}  // namespace toftwin::compare
