// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "calib/discover/found_effects.h"

/// One cause, one effect.
namespace toftwin::discover {

/// A carrier without a covariate stands for all that its word means: light from neighbours for how bright the
/// surroundings are, a pattern of pixels for columns and rows.
bool goAlongTheSame(const Context& context, const Effect& a, const Effect& b);

/// What cannot be told from more of an effect that is known to first order or as a curve is more of it,
/// whatever else may explain it as well. Its place among the explanations.
std::optional<std::size_t> partOfAKnown(const Found& found, const std::vector<Explanation>& explanations,
                                        const Effect& effect);

/// The effect of an uncertain name which `effect` takes it from: what goes along a curve that the name was not told from
/// is more of that curve, and a name that leaves more of it is not its cause. Its place among the found ones.
std::optional<std::size_t> nameInDoubt(const Found& found, const Effect& effect);

/// A curve without a formula is known to some per cent, since between its knots it is straight, and so is
/// what light does, since it is added to first order: what little is left beside it is not called another
/// effect.
bool isWhatACurveLeaves(const Found& found, const Effect& effect);

/// The share of what a form explains below which what it leaves is its rest: a convention.
inline constexpr double kRest = 0.25;

/// A form without a name describes its cause to first order and along its own covariates alone. What that
/// leaves goes with something else, and needs no cause of its own while it is less than a quarter of what the
/// form explains and both share a part: it stays in the model, as the rest of that effect. An effect that is
/// named for certain describes itself, and leaves nothing.
void markRests(Found& found);

}  // namespace toftwin::discover
