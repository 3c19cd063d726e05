// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calib/compare/named_traits.h"
#include "calib/plan/compared_run.h"

namespace toftwin::plan {

/// Conditions (a place, light, exposure) at which one camera lacks over 5 % of what either sees there, and the
/// other has it in all captures of the condition; the worst first. Means over all conditions hide one of them.
/// Not with the lens covered. Where both lack pixels of each other's, as noise makes them, one lacks over twice
/// as many as the other.
std::vector<compare::MissingAt> missingOf(const ComparedRun& run);

}  // namespace toftwin::plan
