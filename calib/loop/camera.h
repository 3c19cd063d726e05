// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/loop/camera_text.h"
#include "calib/loop/discovery.h"

namespace toftwin::loop {

/// The camera with what was found in a table, each effect a section of its own, and what could not be taken over.
struct MendedCamera {
  std::string toml{};
  std::vector<std::string> notes{};
};
/// Columns are what the simulator calls so, or what their units say. Errors: values that are no lengths; a camera that the
/// simulator then refuses.
Result<MendedCamera> cameraWith(const Discovery& discovery, const CameraText& camera);

}  // namespace toftwin::loop
