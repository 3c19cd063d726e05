// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <toftwin/geometry.h>
#include <toftwin/result.h>

#include "tools/cli/arguments.h"

namespace toftwin::cli {

/// The pose of a camera at `position_m` whose axis meets `look_at_m` and in whose image `up` points
/// up; each three numbers. An empty `look_at_m` leaves the camera's axes parallel to the world's.
Result<Transform<World, Camera>> lookFrom(const std::vector<double>& position_m,
                                          const std::vector<double>& look_at_m,
                                          const std::vector<double>& up);

/// --position and what else says how a camera stands: as a point that it looks at, or as the two
/// kinds of rotation that a pose file has.
struct PoseOptions {
  std::vector<double> position_m;
  std::vector<double> look_at_m;
  std::vector<double> up{0.0, -1.0, 0.0};
  std::vector<double> euler_deg;
  std::vector<double> rotation_wxyz;
  void add(Arguments& args);
  [[nodiscard]] bool isGiven() const;
  /// Whether the way it is turned is given, not only the place.
  [[nodiscard]] bool isTurned() const;
  /// What is not given is the pose of a camera at the origin that looks along z.
  [[nodiscard]] Result<Transform<World, Camera>> pose() const;
};

}  // namespace toftwin::cli
