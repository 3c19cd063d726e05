// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {

/// y = Σ p_k column_k + u_c + e: rows of one cluster, such as the cells of one capture, share an error u_c
/// besides their own (one-way random effects). The ratio λ of the variances of u and e is REML's (H. D.
/// Patterson, R. Thompson, Biometrika 58 (1971) 545); given λ it is least squares of rows less θ_c of their
/// cluster's mean, θ_c = 1 − 1/√(1 + λ n_c). The degrees of freedom are Satterthwaite's, between G − 1 for G
/// clusters and n − k. The first column is the constant. `squares` are those of the transformed rows. Nothing
/// if n ≤ k, for fewer than two clusters, or if the rows leave a parameter undetermined.
std::optional<Fit> fitInClusters(const std::vector<std::vector<double>>& columns, Column y,
                                 std::span<const std::size_t> cluster);

/// Mean of each cluster's values, by ascending cluster; values that are not finite are left out.
std::vector<double> clusterMeans(Column values, std::span<const std::size_t> cluster);

}  // namespace toftwin::compare
