// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/discover/campaign/rows/learned_effect.h"
#include "calib/discover/campaign/rows/refit.h"
#include "calib/discover/campaign/rows/rows.h"
#include "calib/discover/finding.h"

namespace toftwin::discover {

/// An effect that the finder named by its covariates, in forms that the simulator knows: its terms as they were found, a
/// kernel of light from neighbours, a pattern of pixels, constant charges in raw exposures, stray light. Nothing where there is no form. `rows`: with everything in their model that was found by
/// name.
std::vector<LearnedEffect> learnedEffectsOf(const Effect& effect, const CampaignRows& rows,
                                            const sim::SensorModel& model);

/// [[effect]] with its keys, as a camera file has it, and what is known of its numbers as comments.
std::string tomlOf(const FittedEffect& effect, const std::string& why);

/// A camera file with effects more, and with other numbers in those that it has: the text stays as
/// it is but for these. `declared`: the file's effects, in its order; `updates`: for each of them,
/// empty where nothing changes.
std::string withEffects(std::string_view camera_file, const std::vector<sim::AnyEffect>& declared,
                        const std::vector<std::optional<FittedEffect>>& updates,
                        const std::vector<FittedEffect>& added, const std::string& about);

}  // namespace toftwin::discover
