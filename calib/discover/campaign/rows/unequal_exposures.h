// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/discover/campaign/captures/catalogue.h"
#include "calib/discover/term.h"

/// Raw exposures that are not alike.
namespace toftwin::discover {

struct LearnedEffect;  // model_file.h

/// One brighter or darker in both taps than the others, as where its light's supply sags, or taken with a reference
/// that is late. To first order, of one of K raw exposures at the phase θ, z ∝ e^(iφ) changes by
///     δz/z = (γ/K) (1 + e^(2iθ − 2iφ)),    δz/z = −i (ψ/K) (1 − e^(2iθ − 2iφ)) :
/// two cycles per turn, a quarter of a turn apart, so that those of the first raw exposure span those of any.
inline constexpr std::string_view kUnequalCarrier = "unequal";
/// One tap of a raw exposure amplified more: half of that, and a charge in proportion to what is collected without
/// being modulated, ambient light with it, at the phase θ. Two exposures at different phases span those of any.
inline constexpr std::string_view kAmplifiedCarrier = "amplified";

/// A carrier, and the effects that make one unit of it: 1 % or 1/100 rad.
using UnequalExposure = std::pair<std::string, std::vector<sim::AnyEffect>>;
/// Of the first raw exposure of each frequency and a second one, a quarter of a turn later where there is one there.
/// Empty for fewer than three `steps`, and where pixels have one tap, whose gains and light are no few columns.
std::vector<UnequalExposure> unequalExposures(int steps, int taps);

/// What is looked for with them: unequal exposures, and unequal ones whose taps are amplified unequally.
std::vector<TermGroup> unequalGroups(std::span<const UnequalExposure> carriers);

/// The simulator's forms of such terms with their coefficients, whose numbers are fitted; of others: none.
std::vector<LearnedEffect> unequalOf(std::span<const UnequalExposure> carriers,
                                     std::span<const std::pair<Term, double>> terms);

}  // namespace toftwin::discover
