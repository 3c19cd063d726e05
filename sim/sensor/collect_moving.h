// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>

#include "sim/sensor/sensor_model.h"

namespace toftwin::sim {

/// The middle of a raw exposure, since device time 0: when its light is gathered.
Duration middleOf(const Exposure& exposure);
/// Of a frame: the middle of its middle raw exposure.
Duration middleOf(const Moment& moment);

/// SensorModel::collect() where things move: each raw exposure collects the light of its own time. `light_at`
/// gives the light of the raw exposure with that index in moment.exposures, or nothing to give up; with a
/// rolling shutter its rows are of their own times. Motion within a raw exposure is not blurred.
std::optional<Samples> collectMoving(const SensorModel& model, const Moment& moment, std::uint64_t seed,
                                     std::uint64_t frame,
                                     const std::function<const Light*(std::size_t)>& light_at);

}  // namespace toftwin::sim
