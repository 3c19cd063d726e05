// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "calib/intrinsics/board_pose.h"

namespace toftwin::intrinsics {

/// What moves the camera.
struct Rig {};

/// The rig as it says that it stands, and the board as the camera sees it from there.
struct HandEyeView {
  Transform<World, Rig> world_from_rig{};
  KnownPose<Camera, Board> camera_from_board{};
};

struct HandEye {
  KnownPose<Rig, Camera> rig_from_camera{};
  KnownPose<World, Board> world_from_board{};
  /// √ of Σ whitened residuals² over degrees of freedom: 1 where rig and sightings are as good as they say.
  /// Covariances are widened by it where it is above.
  double misfit = 0.0;
  std::size_t worst_view = 0;  ///< which contradicts the others most
  /// Of both together, rig_from_camera first: what the views leave open of one they leave open of the other.
  Eigen::Matrix<double, 12, 12> covariance_of_both = Eigen::Matrix<double, 12, 12>::Zero();
};

/// Where the camera sits on the rig and the board in the world: world_from_rig · rig_from_camera ·
/// camera_from_board = world_from_board in all views, least squares weighted by what is known of each
/// sighting. Errors: fewer than three views; turns about one axis only, which leave a shift along it open.
Result<HandEye> handEye(std::span<const HandEyeView> views);

/// Where the camera stands when the rig does there.
Transform<World, Camera> worldFromCamera(const HandEye& known, const Transform<World, Rig>& world_from_rig);

/// The same as the board would see it, where it may be out of sight.
KnownPose<Board, Camera> boardFromCamera(const HandEye& known, const Transform<World, Rig>& world_from_rig);

}  // namespace toftwin::intrinsics
