// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/geometry.h>
#include <toftwin/result.h>

#include <array>

namespace toftwin::daemon::ros2 {

/// A pose that somebody sent. InvalidArgument: it is no number, or no rotation. ROS programs compute their
/// quaternions in whatever precision they have: one of a length within 1e-3 of 1 is made a unit one.
Result<Transform<World, Camera>> checkPose(const std::array<double, 3>& position_m,
                                           const std::array<double, 4>& rotation_xyzw);

}  // namespace toftwin::daemon::ros2
