// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/plan/seen.h"

namespace toftwin::plan {

/// A plate before the wall: its edges, its light, and the wall's errors where it does not hide it.
void addPlate(const Image<float>& wall_m, const compare::Stack& stack, CameraSeen& seen);
/// The same of a plate that moves: where it is in each frame, and how it is turned by its motion.
void addMovingPlate(const Image<float>& wall_m, const CameraInfo& camera,
                    const std::vector<ReadFrame>& frames, CameraSeen& seen);

}  // namespace toftwin::plan
