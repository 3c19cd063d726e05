// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/pose.h"

#include <algorithm>
#include <cmath>

#include "calib/compare/poses.h"

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

void PoseOptions::add(Arguments& args) {
  const auto numbers = [&args](const char* name, std::vector<double>& values, int count,
                               const char* help) {
    return args.option(name, values, help).separatedBy(',').values(count);
  };
  numbers("--position", position_m, 3, "place of the camera in the world: X,Y,Z in metres");
  const Argument look_at =
      numbers("--look-at", look_at_m, 3,
              "a point on the camera's axis: X,Y,Z in metres; default: along the "
              "world's z");
  numbers("--up", up, 3, "what is up in the world, for --look-at; default: 0,-1,0").needs(look_at);
  const Argument euler =
      numbers("--euler-deg", euler_deg, 3,
              "how it is turned, instead of --look-at: X,Y,Z in degrees about the fixed "
              "world axes x, then y, then z")
          .excludes(look_at);
  numbers("--rotation-wxyz", rotation_wxyz, 4,
          "how it is turned, instead of --look-at: a quaternion W,X,Y,Z")
      .excludes(look_at)
      .excludes(euler);
}

bool PoseOptions::isTurned() const {
  return !look_at_m.empty() || !euler_deg.empty() || !rotation_wxyz.empty();
}

bool PoseOptions::isGiven() const { return !position_m.empty() || isTurned(); }

Result<Transform<World, Camera>> PoseOptions::pose() const {
  const auto isFinite = [](const std::vector<double>& values) {
    return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
  };
  for (const auto* values : {&position_m, &look_at_m, &up, &euler_deg, &rotation_wxyz}) {
    if (!isFinite(*values))
      return Error{Error::Code::InvalidArgument, "a pose is given in finite numbers"};
  }
  const std::vector<double> place = position_m.empty() ? std::vector<double>(3, 0.0) : position_m;
  if (!look_at_m.empty()) return lookFrom(place, look_at_m, up);
  compare::PoseSpec spec;
  std::ranges::copy(place, spec.position_m.begin());
  std::ranges::copy(euler_deg, spec.euler_deg.begin());
  if (!rotation_wxyz.empty()) {
    std::ranges::copy(rotation_wxyz, spec.rotation_wxyz.begin());
    if (std::ranges::all_of(rotation_wxyz, [](double value) { return std::abs(value) < 1e-6; })) {
      return Error{Error::Code::InvalidArgument,
                   "--rotation-wxyz is all zeros, which is no rotation; 1,0,0,0 is none at all"};
    }
  }
  return spec.world_from_camera();
}

}  // namespace toftwin::cli
