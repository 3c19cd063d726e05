// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/compare/named_traits.h"
#include "calib/plan/compared_run.h"

namespace toftwin::plan {

/// Waves and lines over distance of a run's blocks of kind distance: of A and of B against the plan's wall, each by
/// its own frequencies, and of B − A where both have the same.
void addHarmonics(const ComparedRun& run, compare::TraitCollector& all);

}  // namespace toftwin::plan
