// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

/// Errors of a least-squares fit whose observations err alike within clusters, by how much the clusters disagree.
namespace toftwin::intrinsics {

/// 97.5 % of Student's t lie below: the Cornish-Fisher expansion, right to 0.5 % from 4 degrees on.
double studentQuantile(double degrees);

/// What one cluster of observations says of the parameters.
struct SharedInformation {
  Eigen::MatrixXd information;  ///< Σ Jᵀ J
  Eigen::VectorXd gradient;     ///< Σ Jᵀ r, zero in sum at the best
};

/// The clusters' gradients, made as large as their errors are. At the best a cluster's gradient is smaller than its
/// error, because the parameters have bent towards it. With S = Σ S_v = L Lᵀ and M_v = L⁻¹ S_v L⁻ᵀ,
///   g̃_v = L (1 − M_v)^(−1/2) L⁻¹ g_v
/// has the covariance σ² S_v if all observations err alike ("CR2" of R. M. Bell and D. F. McCaffrey, Survey
/// Methodology 28 (2002) 169).
std::vector<Eigen::VectorXd> unbent(const std::vector<SharedInformation>& clusters, const Eigen::MatrixXd& total);

/// Standard errors from how much the clusters disagree, √ diag(S⁻¹ (Σ g̃_v g̃_vᵀ) S⁻¹), and the degrees of freedom of
/// each for Student's quantile, which a few clusters that know most of a parameter make few (Satterthwaite's, as Bell
/// and McCaffrey take them: of errors that are alike).
struct ClusteredErrors {
  Eigen::VectorXd standard;
  Eigen::VectorXd degrees;
};
ClusteredErrors clusteredErrors(const std::vector<SharedInformation>& clusters);

/// From this ratio of clustered to independent standard errors on, the clusters' disagreement is believed: a few
/// clusters disagree by chance as well, of 200 boards with independent errors (tests/intrinsics) by as much in one
/// number in ten.
inline constexpr double kClustered = 1.5;

/// By how much the intervals of `independent` standard errors, for Student's t of `degrees`, are to be widened to be
/// those of the clusters, number by number; 1 where the clusters disagree by less than kClustered times.
Eigen::VectorXd widenedBy(const ClusteredErrors& clustered, const Eigen::VectorXd& independent, double degrees);

}  // namespace toftwin::intrinsics
