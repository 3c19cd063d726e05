// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/plan/compared_run.h"

namespace toftwin::plan {

/// Noise of A and of B: of frames at a middle distance; over amplitude the temporal noise of all captures and
/// the fixed pattern of a wall's middle; both of the wall's middle over distance.
void addNoiseTraits(const ComparedRun& run, compare::TraitCollector& all);

}  // namespace toftwin::plan
