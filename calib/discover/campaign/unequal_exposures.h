// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/discover/campaign/catalogue.h"
#include "calib/discover/term.h"

/// Raw exposures that are not alike.
namespace toftwin::discover {

struct LearnedEffect;  // model_file.h

/// One in all its taps brighter or darker than the others, as where its light's supply sags, or taken with a reference
/// that is late. Either errs with two cycles per turn, a quarter of a turn apart, whatever the amplitude.
inline constexpr std::string_view kUnequalCarrier = "unequal";
/// One tap of a raw exposure amplified more: what is collected without being modulated, ambient light with it, then
/// is a charge.
inline constexpr std::string_view kAmplifiedCarrier = "amplified";

/// A carrier, and the effects that make one unit of it: 1 % or 1/100 rad.
using UnequalExposure = std::pair<std::string, std::vector<sim::AnyEffect>>;
/// Those of the first raw exposure of each frequency, and of the one a quarter of a turn later. Empty where a frequency
/// does not have four `steps` or a multiple.
std::vector<UnequalExposure> unequalExposures(int steps, int taps);

/// What is looked for with them: unequal exposures, and unequal ones whose taps are amplified unequally.
std::vector<TermGroup> unequalGroups(std::span<const UnequalExposure> carriers);

/// The simulator's forms of such terms with their coefficients, whose numbers are fitted; of others: none.
std::vector<LearnedEffect> unequalOf(std::span<const UnequalExposure> carriers,
                                     std::span<const std::pair<Term, double>> terms);

}  // namespace toftwin::discover
