// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tools/cli/export/export.h"

namespace toftwin::cli {

/// A frame as points, for the formats of point clouds.
struct Cloud {
  std::size_t width = 0, height = 0;  ///< one row of valid points, or the image's rows and columns
  bool has_amplitude = false;
  std::vector<float> numbers;  ///< x, y, z in metres and perhaps the amplitude, point by point; NaN where invalid
  std::string note;
};

/// The plane's points in the camera's coordinates, or with `options.world` in the world's: the valid ones, or with
/// `options.organised` one for each pixel. Errors: no such plane, or one that is not of metres; no pose.
Result<Cloud> cloudOf(const Frame& frame, const ExportOptions& options);

/// "real frame 7 of kinect, calibration unknown", on one line.
std::string titleOf(const Frame& frame);

}  // namespace toftwin::cli
