// SPDX-License-Identifier: Apache-2.0
#include "protocol/settings/describe.h"
#include "sim/sensor/camera_file.h"
#include "sim/sensor/sensor_model.h"

namespace toftwin::sim {

std::string cameraFileTable() { return settings::markdownTable(settings::keysOf<CameraFile>()); }

}  // namespace toftwin::sim
