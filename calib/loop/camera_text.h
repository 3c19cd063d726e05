// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <toftwin/result.h>

#include "sim/sensor/sensor_model.h"

namespace toftwin::loop {

/// A camera as a file says it, with the text that is to be mended.
struct CameraText {
  sim::SensorModel model;
  std::string text{};
};
/// `model`: a file, or a preset's name with "preset:" before it or without. Errors: neither is there, or it is no camera.
Result<CameraText> loadCamera(const std::string& model);

}  // namespace toftwin::loop
