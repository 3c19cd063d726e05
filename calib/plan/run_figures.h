// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calib/plan/compared_run.h"

namespace toftwin::plan {

/// A and B by themselves beside each other, the curves that were fitted to them, and B − A below: drift over
/// time, error over distance against the plan's wall, noise over amplitude and distance. Those that the run
/// has rows for.
std::vector<compare::Block> characteristicFigures(const RunTraits& traits);

}  // namespace toftwin::plan
