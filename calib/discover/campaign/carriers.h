// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/discover/campaign/reading.h"
#include "calib/discover/term.h"

/// Effects without a name that are no error of the range alone: light that comes from neighbours, and charge
/// that does not come from light. Functions of covariates are multiplied with what they do.
namespace toftwin::discover {

/// Changes of range and ln amplitude, to first order in the highest frequency's phasor z:
///     δ ln|z| = Re(δz/z),   δr = −(R/2π) Im(δz/z)
/// for light from a square of neighbours (δz = 1 % of its mean z), and for an electron more in the correlation's
/// real or imaginary part (δz = 2/N or 2i/N, N raw exposures).
/// And a gain of 1 % of the amplitude.
std::map<std::string, Reading> carriersOf(const sim::SensorModel& model, const Reading& declared,
                                          double period_m);

/// What is looked for with them: a kernel of squares of light; charge that is constant or goes with exposure,
/// ambient light or temperature; a gain that goes with any covariate.
std::vector<TermGroup> carrierGroups(std::span<const CovariateInfo> covariates);

/// What effects of the catalogue call a carrier; empty: it is none.
std::string_view wordOfCarrier(std::string_view carrier);

}  // namespace toftwin::discover
