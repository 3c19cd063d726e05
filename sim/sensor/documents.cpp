// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "protocol/settings/describe.h"
#include "sim/sensor/camera_file.h"
#include "sim/sensor/sensor_model.h"

namespace toftwin::sim {

std::string cameraFileTable() {
  CameraFile example;
  return settings::markdownTable(settings::keysOf(example));
}

std::string effectTables() {
  std::string text;
  AllEffects::forEach([&]<class E>() {
    text += fmt::format("### `{}`\n\n{}, on {}.\n\n{}\n", E::about.name, E::about.summary, stageOf<E>(),
                        settings::markdownTable(settings::keysOf<E>()));
  });
  return text;
}

}  // namespace toftwin::sim
