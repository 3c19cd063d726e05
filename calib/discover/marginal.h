// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "calib/discover/evidence.h"

/// Least squares on Gram matrices, with what is drawn anew for each capture integrated out.
namespace toftwin::discover {

using Columns = std::vector<Eigen::Index>;

/// Evidence under y ~ N(Xβ, I + Z S² Zᵀ) for each capture, Z its PerCapture columns and S their scales. Its
/// Gram is Xᵀ(I + Z S² Zᵀ)⁻¹X by the Woodbury identity; these columns are gone, the others are renumbered.
struct Marginal {
  std::vector<Group> groups{};
  std::vector<CaptureEvidence> captures{};
  Eigen::VectorXd precision{};   ///< of the priors: 1/s² of Shared columns, 0 elsewhere
  double log_determinant = 0.0;  ///< Σ ln det(I + Z S² Zᵀ), and of the Shared priors
  Eigen::MatrixXd gram{};        ///< sum over captures
  Eigen::VectorXd moment{};
  double energy = 0.0, rows = 0.0;
};
/// `scale`: a factor on the nominal deviation for each scale class; classes beyond it have 1.
Marginal marginalise(const Evidence& evidence, std::span<const double> scale);

/// Columns of the groups that are always there.
Columns nuisanceColumns(const Marginal& marginal);
void append(Columns& columns, const Group& group);

/// The inverse of a symmetric matrix that may be singular: directions with less than `tolerance` of their
/// columns' own size are left out.
struct PseudoInverse {
  Eigen::MatrixXd inverse{};
  int rank = 0;
};
PseudoInverse pseudoInverse(const Eigen::MatrixXd& matrix, double tolerance = 1e-9);

/// A fit of some columns to some captures.
struct Fit {
  Columns columns{};
  Eigen::MatrixXd inverse{};  ///< (G + P)⁻¹
  Eigen::VectorXd coefficient{};
  double deviance = 0.0;  ///< of what is left, with the priors' share
  double freedom = 0.0;   ///< rows − rank
  [[nodiscard]] double dispersion() const { return freedom > 0.0 ? deviance / freedom : 1.0; }
};
Fit fit(const Marginal& marginal, const Columns& columns);

/// yᵀy of a capture with Xβ taken off: what is left of its energy by these coefficients of these columns.
double energyLeft(const CaptureEvidence& capture, const Columns& columns, const Eigen::VectorXd& coefficient);

/// Factors on the nominal deviations that make the data most likely (restricted maximum likelihood: the
/// coefficients of `columns` are integrated out, D. A. Harville, JASA 72 (1977) 320), by classes in turn.
std::vector<double> estimateScales(const Evidence& evidence, std::span<const std::string> projected);

}  // namespace toftwin::discover
