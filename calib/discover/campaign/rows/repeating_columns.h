// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calib/discover/campaign/rows/learned_effect.h"
#include "calib/discover/term.h"

namespace toftwin::discover {

/// Charges in phase and in quadrature, and gains, of every m-th column, m = 2 to 8: as cameras have them whose columns
/// share converters. With the charge that all have in common, which is no cause of its own. Empty where no covariate
/// "column" is.
std::vector<TermGroup> repeatingColumns(std::span<const CovariateInfo> covariates);

/// The simulator's form of such terms with their coefficients; nothing where there are none. All of its numbers are
/// fitted, but for a gain of all columns, which is the camera's.
std::optional<LearnedEffect> columnsOf(std::span<const std::pair<Term, double>> terms);

}  // namespace toftwin::discover
