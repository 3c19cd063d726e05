// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "calib/intrinsics/board_pose.h"
#include "calib/intrinsics/clusters.h"

namespace toftwin::intrinsics {

/// A plane that a camera sees: normal · p = distance for its points, normal towards the camera, so distance
/// is negative.
struct SeenPlane {
  Direction<Camera> normal{};
  double distance_m = 0.0;
  /// Of m = normal / distance, in 1/m: what is fitted.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double rms_mm = 0.0;     ///< of ranges along the rays, of those that count
  std::size_t pixels = 0;  ///< that count
  /// What those in each part of the image say of m, in units of the covariance: together its inverse. Parts without a
  /// pixel are left out.
  std::vector<SharedInformation> parts{};
};

/// The plane of so many pixels' ranges. On a plane 1/range = m · ray, linear in m = normal / distance: least
/// squares with weights range⁴ (errors of range are taken as alike), and Tukey's biweight against what is no
/// plane. Error: fewer than 20 valid pixels, or pixels along one line.
Result<SeenPlane> fitPlane(const Image<float>& range_m, const CameraInfo& camera,
                           std::span<const std::uint32_t> pixels);

/// A plane that is known: normal · p = distance for its points in the world, normal towards the cameras.
struct KnownPlane {
  Direction<World> normal{};
  double distance_m = 0.0;
};

/// Whether these planes tell a camera's pose. Error: fewer than three, or normals that do not span space.
Result<> tellThePose(std::span<const KnownPlane> planes);

/// Where the camera stands that sees these planes, one by one. Error: planes that do not tell it. Least squares in m
/// weighted by the planes' covariances. Each number's interval is that of pixels which err by themselves, or the one of
/// how much parts of the image contradict the pose, if that is wider. What the ranges of all parts are off by alike, as by
/// an offset, is in the pose and in neither.
Result<KnownPose<World, Camera>> poseFromPlanes(std::span<const SeenPlane> seen,
                                                std::span<const KnownPlane> known);

}  // namespace toftwin::intrinsics
