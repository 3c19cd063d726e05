// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "drivers/sim/keys.h"
#include "sim/sensor/color.h"
#include "sim/sensor/sensor_model.h"
#include "tools/cli/command.h"

namespace toftwin::cli {

/// Writes what the camera's lenses give as pictures to look at, beside `file`: infrared and depth
/// of the frame and, where the camera has a colour lens, colour from its own place, and each
/// registered to the other. `scene` is a scene file, or empty for the default scene.
Result<Exit> renderImages(const Frame& frame, const sim::SensorModel& model,
                          const std::string& scene, const std::string& file,
                          const drivers::simulator::Keys& keys);

}  // namespace toftwin::cli
