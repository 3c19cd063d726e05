// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "tools/cli/import/lens/lens_of_info.h"

namespace toftwin::cli {

/// The lens in a text of ROS (camera_info in YAML) or of OpenCV (YAML or XML of cv::FileStorage, whatever its calibration
/// programs call the matrices). InvalidArgument names what is missing. `file` stands for it in errors.
Result<FoundLens> lensOfText(std::string_view text, const std::string& file);

/// Of a preset ("kinect_v2"), a camera file, a calibration, or a file as above. Files of more than 1 MiB are none.
Result<FoundLens> lensNamed(const std::string& name);

}  // namespace toftwin::cli
