// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "drivers/sim/color_view.h"
#include "drivers/sim/keys.h"
#include "protocol/settings/settings.h"
#include "sim/sensor/sensor_model.h"

namespace toftwin::drivers::simulator {

/// What a [[source]] table with driver = "sim" asks for.
struct Chosen {
  Keys keys;
  sim::SensorModel model;
  sim::Scene scene;
  std::vector<PlaneKind> planes;
  std::optional<ColorView> color;  ///< if its plane is among them
};
Result<Chosen> choose(settings::Table& table);

/// Frames must not overlap: the next begins when the last raw exposure of this one is over.
Result<> exposuresFit(const sim::SensorModel& model, Duration frame_interval);

}  // namespace toftwin::drivers::simulator
