// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/ros2/pose.h"

#include <fmt/format.h>

#include <cmath>

namespace toftwin::daemon::ros2 {

Result<Transform<World, Camera>> checkPose(const std::array<double, 3>& position_m,
                                           const std::array<double, 4>& rotation_xyzw) {
  constexpr double kMostError = 1e-3;
  const auto& [x, y, z, w] = rotation_xyzw;
  const double norm = std::sqrt(x * x + y * y + z * z + w * w);
  const bool is_place =
      std::isfinite(position_m[0]) && std::isfinite(position_m[1]) && std::isfinite(position_m[2]);
  if (!is_place || !(std::abs(norm - 1.0) <= kMostError)) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format(
            "a pose needs finite metres and a unit quaternion, but was ({}, {}, {}) with x, y, z, w = "
            "({}, {}, {}, {})",
            position_m[0], position_m[1], position_m[2], x, y, z, w)};
  }
  // One that is a unit quaternion already is not touched, so that a pose comes back bit for bit.
  const double scale = std::abs(norm - 1.0) < 1e-12 ? 1.0 : 1.0 / norm;
  return Transform<World, Camera>{{w * scale, x * scale, y * scale, z * scale},
                                  {position_m[0], position_m[1], position_m[2]}};
}

}  // namespace toftwin::daemon::ros2
