// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <toftwin/camera_info.h>
#include <toftwin/result.h>

#include "protocol/ros/messages.h"

namespace toftwin::cli {

struct FoundLens {
  CameraInfo camera;
  std::string note;  ///< what was approximated, or empty
};

/// The lens that ROS's camera info describes, for the raw image, or for the rectified one (its projection matrix, without
/// distortion); region and binning are applied. plumb_bob is our own model; rational_polynomial and equidistant are fitted by
/// it, and the note says how well. Errors: not calibrated (k[0] = 0), sizes or numbers that cannot be, another model.
Result<FoundLens> lensOf(const ros::CameraInfo& info, bool is_rectified);

}  // namespace toftwin::cli
