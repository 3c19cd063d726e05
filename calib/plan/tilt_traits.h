// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/compare/named_traits.h"
#include "calib/plan/compared_run.h"

namespace toftwin::plan {

/// By how much B − A grows from the left edge of the image to the right one, and from the top to the bottom, before the
/// plan's wall: what delays of columns and rows make, a lens that is not as it is said to be, or a pose that is
/// turned. Of conditions whose pose was seen it is not told: they share its turn.
void addTilt(const ComparedRun& run, compare::TraitCollector& all);

}  // namespace toftwin::plan
