// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "calib/discover/finding.h"

/// The numbers of effects that were chosen, all at once, with their uncertainties.
namespace toftwin::discover {

/// The groups of the effects' parts, in their order.
std::vector<TermGroup> groupsOf(std::span<const Effect> effects);

/// The same parts with one inner number moved by a small step, for each inner number in turn: with them, a
/// model spans its own derivatives.
std::vector<TermGroup> tangentsOf(std::span<const Effect> effects);

/// Coefficients and inner numbers by Gauss-Newton, jointly with nuisances; fills coefficient, inner, numbers
/// and covariance of the effects, and gives the nuisances; a gain that an effect contains is 0, its error NaN. The
/// covariance is the larger of two: the noise's
///   σ² (JᵀGJ)⁻¹, and the captures' own   (JᵀGJ)⁻¹ Σ_c r_c r_cᵀ (JᵀGJ)⁻¹ · C/(C − p)
/// (K.-Y. Liang, S. L. Zeger, Biometrika 73 (1986) 13), r_c the capture's moment of the residual.
std::vector<Estimate> estimate(const RowSource& source, std::span<const double> scales,
                               std::vector<Effect>& effects);

}  // namespace toftwin::discover
