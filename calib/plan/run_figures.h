// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calib/plan/run_traits.h"

namespace toftwin::plan {

/// A and B by themselves beside each other, with the curves that their traits say: drift over time, error
/// over distance against the plan's wall, noise over amplitude. Those that the run has rows for.
std::vector<compare::Figure> characteristicFigures(const ComparedRun& run, const RunTraits& traits);

}  // namespace toftwin::plan
