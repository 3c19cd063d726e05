// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "calib/plan/compared_run.h"

namespace toftwin::plan {

/// Of one camera: what the first frame after a change of light or range has of what was before, and by how much
/// motion turns a plate.
void addChangeTraits(const ComparedRun& run, std::size_t camera, compare::TraitCollector& all);
/// How much later B sees the moving plate where A saw it, where both say the scene's own time: of simulated cameras.
void addLatency(const ComparedRun& run, compare::TraitCollector& all);

}  // namespace toftwin::plan
