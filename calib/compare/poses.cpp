// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/poses.h"

#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "protocol/settings/settings.h"

namespace toftwin::compare {

Transform<World, Camera> PoseSpec::world_from_camera() const {
  Transform<World, Camera> pose;
  constexpr double kRadians = std::numbers::pi / 180.0;
  if (euler_deg != std::array<double, 3>{}) {
    const auto x = rotation<World, World>({1, 0, 0}, euler_deg[0] * kRadians);
    const auto y = rotation<World, World>({0, 1, 0}, euler_deg[1] * kRadians);
    const auto z = rotation<World, World>({0, 0, 1}, euler_deg[2] * kRadians);
    pose.rotation_wxyz = (z * y * x).rotation_wxyz;
  } else {
    double squares = 0.0;
    for (const double q : rotation_wxyz) squares += q * q;
    for (std::size_t i = 0; i < 4; ++i)
      pose.rotation_wxyz[i] = rotation_wxyz[i] / std::sqrt(squares);
  }
  pose.translation_m = {position_m[0], position_m[1], position_m[2]};
  return pose;
}

Result<std::vector<PoseSpec>> loadPoses(const std::filesystem::path& file) {
  auto read = settings::loadFile<PoseFile>(file);
  if (!read) return read.error();
  if (read->poses.empty()) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: has no [[pose]]; write one table for each pose", file.string())};
  }
  for (std::size_t i = 0; i < read->poses.size(); ++i) {
    PoseSpec& pose = read->poses[i];
    if (pose.name.empty()) pose.name = fmt::format("pose {}", i + 1);
    double squares = 0.0;
    for (const double q : pose.rotation_wxyz) squares += q * q;
    if (squares < 1e-12) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("{}: rotation_wxyz of \"{}\" is all zeros, which is no rotation",
                               file.string(), pose.name)};
    }
  }
  return std::move(read->poses);
}

}  // namespace toftwin::compare
