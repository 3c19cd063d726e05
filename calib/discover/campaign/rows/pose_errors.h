// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Dense>
#include <toftwin/geometry.h>

#include "calib/discover/term.h"

/// Errors of the poses that are not of one capture alone: of the rig, of how the camera sits on it, of where the scene
/// stands. Errors of the reference, which no model of a camera may take for its own.
namespace toftwin::discover {

inline constexpr std::string_view kPoseCarrier = "pose";

/// A camera that sits elsewhere on its rig, or turned: the same in its own frame (five). A scene that stands elsewhere
/// than its file says: the same in the world (three). A rig that goes farther than it says: a share of its way, from a
/// zero that is not known (these three and one).
std::vector<TermGroup> poseGroups();

/// What such errors change in a capture, one column for each carrier of those groups: of a millimetre, of a tenth of a
/// degree, of a millimetre per metre of way. `moves`: whitened cells × (right, down, ahead by a millimetre, turned
/// about x and about y by a tenth of a degree). Nothing where the capture's channel has no cells.
std::map<std::string, Eigen::VectorXf> poseColumns(const Eigen::MatrixXf& moves,
                                                   const Transform<World, Camera>& world_from_camera);

/// Whether all that covariates say is that the poses err.
bool isOfPoses(const std::vector<std::string>& covariates);

}  // namespace toftwin::discover
