// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/frequency_offset.h"

#include "sim/effects/phasors.h"

namespace toftwin::sim {

Light FrequencyOffset::apply(Light light, const Conditions&, const Random&) const {
  const double offsets_rad[] = {first.in(radian), second.in(radian), third.in(radian)};
  if (offsets_rad[0] == 0.0 && offsets_rad[1] == 0.0 && offsets_rad[2] == 0.0) return light;
  multiplyPhasors(light, [&](std::size_t f, int n) {
    return std::polar(1.0, f < std::size(offsets_rad) ? -n * offsets_rad[f] : 0.0);
  });
  return light;
}

}  // namespace toftwin::sim
