// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/discover/campaign/captures/reading.h"
#include "calib/discover/campaign/rows/learned_effect.h"
#include "calib/discover/term.h"

/// Ranges that come from their neighbours', as of a firmware that filters them: the light is as it was.
namespace toftwin::discover {

inline constexpr std::string_view kSmearedCarrier = "smeared";

/// What 1 % of a neighbour's range in place of a pixel's own changes: of the left one less that of the right one
/// ("smeared:across"), of the upper less that of the lower ("smeared:along"), of the mean of all eight
/// ("smeared:around"). Nothing beside what has no range.
std::map<std::string, Reading> smearedCarriers(const Reading& declared);

/// Smears of all pixels, and such as go with the amplitude, since filters are for what is dim.
std::vector<TermGroup> smearedGroups(std::span<const CovariateInfo> covariates);

/// The simulator's form of such terms with their coefficients, at these amplitudes; nothing where there are none.
std::optional<LearnedEffect> smearOf(std::span<const std::pair<Term, double>> terms,
                                     const std::vector<double>& amplitudes);

}  // namespace toftwin::discover
