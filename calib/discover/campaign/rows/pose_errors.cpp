// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/pose_errors.h"

#include <fmt/format.h>

namespace toftwin::discover {
namespace {

constexpr std::array kOfCamera{"right", "down", "ahead", "about_x", "about_y"};
constexpr std::array kOfWorld{"world_x", "world_y", "world_z"};
constexpr const char* kOfWay = "way";

std::string poseCarrierOf(const char* part) { return fmt::format("{}:{}", kPoseCarrier, part); }

Term poseTermOf(const char* part) { return {{}, Stage::Range, poseCarrierOf(part)}; }

/// What moving the camera by a vector of the world, in millimetres, changes.
Eigen::VectorXf movedBy(const Eigen::MatrixXf& moves, const Transform<World, Camera>& pose, const Vec3d& by_mm) {
  const Vec3d own = pose.inverse().rotate(by_mm);
  return static_cast<float>(own.x) * moves.col(0) + static_cast<float>(own.y) * moves.col(1) +
         static_cast<float>(own.z) * moves.col(2);
}

}  // namespace

std::vector<TermGroup> poseGroups() {
  TermGroup mount{"the camera sits elsewhere on its rig", Kind::Generic, {}, 0},
      scene{"the scene stands elsewhere", Kind::Generic, {}, 0},
      rig{"the rig goes farther than it says", Kind::Generic, {poseTermOf(kOfWay)}, 0};
  for (const char* part : kOfCamera) mount.terms.push_back(poseTermOf(part));
  for (const char* part : kOfWorld) scene.terms.push_back(poseTermOf(part)), rig.terms.push_back(poseTermOf(part));
  return {std::move(mount), std::move(scene), std::move(rig)};
}

std::map<std::string, Eigen::VectorXf> poseColumns(const Eigen::MatrixXf& moves,
                                                   const Transform<World, Camera>& world_from_camera) {
  std::map<std::string, Eigen::VectorXf> columns;
  if (moves.cols() == 0) return columns;
  for (std::size_t way = 0; way < kOfCamera.size(); ++way)
    columns[poseCarrierOf(kOfCamera[way])] = moves.col(static_cast<Eigen::Index>(way));
  const std::array axes{Vec3d{1.0, 0.0, 0.0}, Vec3d{0.0, 1.0, 0.0}, Vec3d{0.0, 0.0, 1.0}};
  for (std::size_t axis = 0; axis < axes.size(); ++axis)
    columns[poseCarrierOf(kOfWorld[axis])] = movedBy(moves, world_from_camera, axes[axis]);
  columns[poseCarrierOf(kOfWay)] = movedBy(moves, world_from_camera, world_from_camera.translation_m);
  return columns;
}

bool isOfPoses(const std::vector<std::string>& covariates) {
  return covariates == std::vector<std::string>{std::string{kPoseCarrier}};
}

}  // namespace toftwin::discover
