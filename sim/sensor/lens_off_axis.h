// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <toftwin/camera_info.h>

namespace toftwin::sim {

/// In words, that a lens's axis lies outside of the image, for whoever wrote the camera file: right for a part cut out of
/// another image, and mostly a size that was changed alone.
std::optional<std::string> lensOffAxis(const CameraInfo& camera);

}  // namespace toftwin::sim
