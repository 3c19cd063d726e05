// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/discover/campaign/refit.h"
#include "calib/discover/finder.h"

namespace toftwin::discover {

/// An effect that the finder named by its covariates, as one that the simulator knows: a table over
/// them. Nothing where it goes with more than two covariates, or with one that a camera cannot know
/// of itself.
std::optional<sim::AnyEffect> learnedEffectOf(const Effect& effect,
                                              std::span<const CovariateInfo> covariates);

/// [[effect]] with its keys, as a camera file has it, and what is known of its numbers as comments.
std::string tomlOf(const FittedEffect& effect, const std::string& why);

/// A camera file with effects more, and with other numbers in those that it has: the text stays as
/// it is but for these. `declared`: the file's effects, in its order; `updates`: for each of them,
/// empty where nothing changes.
std::string withEffects(std::string_view camera_file, const std::vector<sim::AnyEffect>& declared,
                        const std::vector<std::optional<FittedEffect>>& updates,
                        const std::vector<FittedEffect>& added, const std::string& about);

}  // namespace toftwin::discover
