// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <toftwin/geometry.h>
#include <toftwin/result.h>

#include "drivers/rig/rig_file.h"

namespace toftwin::rig {

/// Where the camera stands when the axes stand at `positions` (mm or degrees).
///   world_from_camera = M_1(q_1) M_2(q_2) … M_n(q_n) mount
///   M linear: translation by q along the direction;  rotary: rotation by q about the axis through
///   the point                                             (product of exponentials, space frame)
Transform<World, Camera> poseAt(const RigFile& rig, const std::vector<double>& positions);

/// The axes' positions within the soft limits that take the camera to the pose; of several the ones
/// closest to `near`. NotFound if the rig cannot get there, with what is nearest.
Result<std::vector<double>> positionsFor(const RigFile& rig, const Transform<World, Camera>& pose,
                                         const std::vector<double>& near);

}  // namespace toftwin::rig
