// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/parameter.h>
#include <toftwin/result.h>

#include "drivers/sim/image_filters.h"
#include "sim/sensor/sensor_model.h"

namespace toftwin::drivers::simulator {

/// What a simulated camera's firmware can be told while it runs, beside the numbers of its model: parameters
/// of the source, listed in docs/drivers/sim.md.
struct Operating {
  std::optional<sim::Operation> operation;  ///< of cameras that can be operated
  double exposure_ratio = 40.0;             ///< of the longer of two exposures to the shorter
  FilterSettings filters;

  static Operating of(const sim::SensorModel& model);
  /// `model` as its file says.
  [[nodiscard]] std::vector<Parameter> parameters(const sim::SensorModel& model) const;
  /// With one of them changed. NotFound: it is none of them.
  [[nodiscard]] Result<Operating> with(const sim::SensorModel& model, std::string_view name,
                                       double value) const;
  [[nodiscard]] sim::SensorModel apply(const sim::SensorModel& model) const {
    return operation ? model.operated(*operation) : model;
  }
  /// Puts the filters into what is said of a frame.
  void note(Provenance& provenance) const;
};

}  // namespace toftwin::drivers::simulator
