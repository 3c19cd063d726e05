// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {

/// y = Σ p_k column_k + u_c + e: rows of one cluster, such as the cells of one capture, share an error u_c
/// besides their own (one-way random effects). The ratio λ of the variances of u and e is REML's (H. D.
/// Patterson, R. Thompson, Biometrika 58 (1971) 545); given λ it is least squares of rows less θ_c of their
/// cluster's mean, θ_c = 1 − 1/√(1 + λ n_c). The degrees of freedom are Satterthwaite's, between those of u,
/// G − 1 or less for G clusters, and n − k. The first column is the constant. `squares` are those of the
/// transformed rows. Nothing if n ≤ k, for fewer than two clusters, or if the rows leave a parameter
/// undetermined.
std::optional<Fit> fitInClusters(const std::vector<std::vector<double>>& columns, Column y,
                                 std::span<const std::size_t> cluster);

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
