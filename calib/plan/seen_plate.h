// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/image.h>

#include "calib/compare/stack.h"
#include "calib/plan/camera_seen.h"
#include "calib/plan/veil.h"

namespace toftwin::plan {

/// What a veil of 1 does to the wall's last cell.
void addVeil(const Veil& veil, CameraSeen& seen);
/// A plate before the wall: its edges, its light, and the wall's errors where it does not hide it.
void addPlate(const Image<float>& wall_m, const compare::Stack& stack, std::span<const double> frequency_hz,
              CameraSeen& seen);
/// The same of a plate that moves: where it is in each frame, and how it is turned by its motion.
void addMovingPlate(const Image<float>& wall_m, const CameraInfo& camera,
                    const std::vector<ReadFrame>& frames, CameraSeen& seen);

}  // namespace toftwin::plan
