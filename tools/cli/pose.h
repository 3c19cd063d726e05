// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <toftwin/geometry.h>
#include <toftwin/result.h>

namespace toftwin::cli {

/// The pose of a camera at `position_m` whose axis meets `look_at_m` and in whose image `up` points
/// up; each three numbers. An empty `look_at_m` leaves the camera's axes parallel to the world's.
Result<Transform<World, Camera>> lookFrom(const std::vector<double>& position_m,
                                          const std::vector<double>& look_at_m,
                                          const std::vector<double>& up);

}  // namespace toftwin::cli
