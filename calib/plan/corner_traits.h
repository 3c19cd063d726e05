// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>

#include "calib/plan/compared_run.h"

namespace toftwin::plan {

/// mm that a camera is off by at a range (m) before its wall alone; NaN where that is not known.
using ErrorAtRange = std::function<double(double range_m)>;

/// Multipath of blocks of kind corner: of each camera, and B − A, in three bands of the distance to the edge, beside
/// what each camera is off by before its wall; and of each camera its fall from the edge, where it is one. Rows are
/// means of a pose: what is off there (the wall, the pose, a simulated camera's light) is so in all repeats.
void addCornerTraits(const ComparedRun& run, const std::array<ErrorAtRange, 2>& own, compare::TraitCollector& all);

}  // namespace toftwin::plan
