// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/pose.h"

#include <algorithm>
#include <cmath>

namespace toftwin::cli {
namespace {

Vec3d vectorOf(const std::vector<double>& xyz) { return {xyz.at(0), xyz.at(1), xyz.at(2)}; }

/// The unit quaternion of a rotation whose matrix has the columns x, y, z: the largest of the four
/// components first, because the others are divided by it.
std::array<double, 4> quaternionOf(Vec3d x, Vec3d y, Vec3d z) {
  const std::array<double, 4> fourfold_squares{1 + x.x + y.y + z.z, 1 + x.x - y.y - z.z,
                                               1 - x.x + y.y - z.z, 1 - x.x - y.y + z.z};
  const auto largest = std::ranges::max_element(fourfold_squares) - fourfold_squares.begin();
  const double s = 2.0 * std::sqrt(fourfold_squares[static_cast<std::size_t>(largest)]);
  switch (largest) {
    case 0:
      return {s / 4, (y.z - z.y) / s, (z.x - x.z) / s, (x.y - y.x) / s};
    case 1:
      return {(y.z - z.y) / s, s / 4, (x.y + y.x) / s, (z.x + x.z) / s};
    case 2:
      return {(z.x - x.z) / s, (x.y + y.x) / s, s / 4, (y.z + z.y) / s};
    default:
      return {(x.y - y.x) / s, (z.x + x.z) / s, (y.z + z.y) / s, s / 4};
  }
}

}  // namespace

Result<Transform<World, Camera>> lookFrom(const std::vector<double>& position_m,
                                          const std::vector<double>& look_at_m,
                                          const std::vector<double>& up) {
  Transform<World, Camera> world_from_camera;
  world_from_camera.translation_m = vectorOf(position_m);
  if (look_at_m.empty()) return world_from_camera;
  const Vec3d towards = vectorOf(look_at_m) - world_from_camera.translation_m;
  // Camera: x right, y down, z along the axis.
  const Vec3d sideways = cross(towards, vectorOf(up));
  if (!(norm(sideways) > 1e-9 * norm(towards) * norm(vectorOf(up)))) {
    return Error{Error::Code::InvalidArgument,
                 "--look-at must be another point than --position, and not straight along --up"};
  }
  const Vec3d z = normalised(towards), x = normalised(sideways);
  world_from_camera.rotation_wxyz = quaternionOf(x, cross(z, x), z);
  return world_from_camera;
}

}  // namespace toftwin::cli
