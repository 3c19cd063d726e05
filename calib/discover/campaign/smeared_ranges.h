// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/discover/campaign/reading.h"
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

}  // namespace toftwin::discover
