// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>
#include <variant>
#include <vector>

#include "sim/decode/decode.h"
#include "sim/sensor/camera_file.h"
#include "sim/sensor/correlate.h"
#include "sim/sensor/sensor_model.h"

namespace toftwin::sim {

struct SensorModel::Impl {
  CameraFile file;
  std::vector<AnyEffect> effects;
  std::string lens_id;  ///< of a lens that was calibrated; empty: the hash of the file's
  // Derived from those above by build():
  CameraInfo camera;
  std::string id;
  std::vector<Response> responses;
  DecodeSettings decoder;
  Rays rays;

  /// Whether an effect adds light at harmonics that the waveforms alone do not have.
  [[nodiscard]] bool addsHarmonics() const {
    return std::ranges::any_of(
        effects, [](const AnyEffect& effect) { return std::holds_alternative<Harmonics>(effect); });
  }
};

}  // namespace toftwin::sim
