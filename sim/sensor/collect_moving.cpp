// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor/collect_moving.h"

#include <utility>

namespace toftwin::sim {

Duration middleOf(const Exposure& exposure) {
  return static_cast<double>(exposure.start.ns) * nanosecond + exposure.duration / 2.0;
}

Duration middleOf(const Moment& moment) { return middleOf(moment.exposures[moment.exposures.size() / 2]); }

std::optional<Samples> collectMoving(const SensorModel& model, const Moment& moment, std::uint64_t seed,
                                     std::uint64_t frame,
                                     const std::function<const Light*(std::size_t)>& light_at) {
  Samples all;
  for (std::size_t e = 0; e < moment.exposures.size(); ++e) {
    const Light* light = light_at(e);
    if (light == nullptr) return std::nullopt;
    Samples samples = model.collect(*light, moment, seed, frame);
    if (e == 0) {
      all = std::move(samples);
      continue;
    }
    // Samples lie in the order of the raw exposures, each with as many images as it has taps.
    const std::size_t images = samples.electrons.size() / moment.exposures.size();
    for (std::size_t i = e * images; i < (e + 1) * images; ++i)
      all.electrons[i] = std::move(samples.electrons[i]);
  }
  return all;
}

}  // namespace toftwin::sim
