// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/thermal_delay.h"

#include "sim/effects/phasors.h"
#include "sim/effects/temperature.h"

namespace toftwin::sim {

Light ThermalDelay::apply(Light light, const Conditions& now, const Random&) const {
  const Length delay = per_degree * degreesAbove(reference, now.moment, "illumination") +
                       per_sensor_degree * degreesAbove(reference, now.moment, "sensor");
  if (delay == 0_mm) return light;
  multiplyPhasors(light, [&](std::size_t f, int n) {
    return std::polar(1.0, -n * phaseOfRange(delay, light.frequencies[f]));
  });
  return light;
}

}  // namespace toftwin::sim
