// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/place.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace toftwin::plan {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr Vec3d kUp{0.0, -1.0, 0.0};

template <class Three>
Vec3d vectorOf(const Three& xyz) {
  return {xyz[0], xyz[1], xyz[2]};
}

/// A rotation that takes the camera's axis to `z` and keeps it upright: first a turn about the vertical, then
/// a nod about the camera's x.
Transform<World, Camera> lookingAlong(Vec3d z) {
  const double turn = std::atan2(z.x, z.z), nod = -std::asin(std::clamp(z.y, -1.0, 1.0));
  return rotation<World, World>({0, 1, 0}, turn) * rotation<World, Camera>({1, 0, 0}, nod);
}

}  // namespace

Target targetOf(const Plan& plan, const BlockSpec& block) {
  Target target{
      block.target_m.empty() ? vectorOf(plan.target_m) : vectorOf(block.target_m),
      normalised(block.target_normal.empty() ? vectorOf(plan.target_normal) : vectorOf(block.target_normal))};
  const auto& size_m = block.target_size_m.empty() ? plan.target_size_m : block.target_size_m;
  if (!size_m.empty()) target.half_width_m = 0.5 * size_m[0], target.half_height_m = 0.5 * size_m[1];
  return target;
}

bool isOnWall(const Target& target, Vec3d point_m) {
  const Vec3d from = point_m - target.point_m;
  // Level along the wall; of one that lies on the floor, x.
  const Vec3d level = cross(kUp, target.normal);
  const Vec3d along = norm(level) > 1e-6 ? normalised(level) : Vec3d{1.0, 0.0, 0.0};
  return std::abs(dot(from, along)) <= target.half_width_m &&
         std::abs(dot(from, cross(target.normal, along))) <= target.half_height_m;
}

compare::PoseSpec poseBefore(const Target& target, double distance_m, double angle_deg) {
  const Vec3d out = rotation<World, World>(kUp, angle_deg * kDegree).rotate(target.normal);
  const Vec3d at = target.point_m + distance_m * out;
  compare::PoseSpec pose;
  pose.name = angle_deg == 0.0 ? fmt::format("{:.6g} m", distance_m)
                               : fmt::format("{:.6g} m, {:.6g}°", distance_m, angle_deg);
  pose.position_m = {at.x, at.y, at.z};
  pose.rotation_wxyz = lookingAlong(-out).rotation_wxyz;
  return pose;
}

Sight sightOf(const Target& target, const compare::PoseSpec& pose) {
  const auto world_from_camera = pose.world_from_camera();
  const Vec3d axis = world_from_camera.rotate({0, 0, 1});
  const Vec3d to_target = target.point_m - world_from_camera.translation_m;
  const double cosine = -dot(axis, target.normal);
  Sight sight{norm(to_target), std::acos(std::clamp(cosine, -1.0, 1.0)) / kDegree};
  // Along the axis s: (p + s z - T) · n = 0. Beside a plane that it grazes there is no such distance.
  const double along = -dot(to_target, target.normal) / cosine;
  if (cosine > 0.05 && along > 0.0) sight.distance_m = along;
  return sight;
}

std::vector<compare::PoseSpec> posesOf(const Plan& plan, const BlockSpec& block) {
  if (!block.poses.empty()) {
    auto poses = block.poses;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (poses[i].name.empty()) poses[i].name = fmt::format("pose {}", i + 1);
    }
    return poses;
  }
  std::vector<compare::PoseSpec> poses;
  const Target target = targetOf(plan, block);
  for (const double distance : block.distance_m) {
    if (block.angle_deg.empty()) poses.push_back(poseBefore(target, distance, 0.0));
    for (const double angle : block.angle_deg) poses.push_back(poseBefore(target, distance, angle));
  }
  return poses;
}

}  // namespace toftwin::plan
