// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <vector>

#include <toftwin/geometry.h>

#include "calib/plan/plan.h"

namespace toftwin::plan {

/// The plane that a block's distances are measured to.
struct Target {
  Vec3d point_m;
  Vec3d normal;  ///< unit, towards the cameras
  /// Of the wall in it, to either side of the point: level along it, and up it. Infinite where the plan does
  /// not say.
  double half_width_m = std::numeric_limits<double>::infinity();
  double half_height_m = std::numeric_limits<double>::infinity();
};
Target targetOf(const Plan& plan, const BlockSpec& block);

/// Whether a point of the target's plane is on the wall.
bool isOnWall(const Target& target, Vec3d point_m);

/// A camera at that distance from the target's point, turned about the vertical by an angle from the normal,
/// that looks at the point, upright (the world's y is down).
compare::PoseSpec poseBefore(const Target& target, double distance_m, double angle_deg);

/// Where a pose's optical axis meets the target's plane, and at what angle.
struct Sight {
  double distance_m = 0.0;  ///< along the axis; to the target's point where it does not meet the plane
  double angle_deg = 0.0;   ///< from the normal
};
Sight sightOf(const Target& target, const compare::PoseSpec& pose);

/// The poses of a block, in the order written: those of the file, or at its distances and angles from the
/// target, looking at it.
std::vector<compare::PoseSpec> posesOf(const Plan& plan, const BlockSpec& block);

}  // namespace toftwin::plan
