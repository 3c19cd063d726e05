// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/result.h>

#include "calib/compare/finding.h"
#include "calib/compare/same_frames.h"
#include "calib/plan/compared_run.h"

namespace toftwin::plan {

/// Error where nothing can be compared: no pixel valid in both at any capture.
Result<compare::Finding> judgeRun(const ComparedRun& run);
/// Of all its captures: whether A and B are two cameras.
compare::SameFrames sameFramesOf(const ComparedRun& run);

}  // namespace toftwin::plan
