// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Drivers, cables and clock trees take longer when warm: the light comes later by what
///     δ = κ_i (T_illumination − T₀) + κ_s (T_sensor − T₀)
/// of range costs there and back, at every frequency the same millimetres:
///     Pₙ → Pₙ · exp(−i 4π n f δ / c)
/// Being in the light, it wraps, and it shifts the wiggling along the range.
struct ThermalDelay {
  Length per_degree = 0.5_mm;
  Length per_sensor_degree = 0.2_mm;
  Temperature reference = 25_degC;

  static constexpr About about{
      .name = "thermal_delay",
      .summary = "light and reference drift apart with the temperatures of illumination and sensor",
      .reference = "TI OPT8241: temperature coefficients of the phase for illumination and sensor",
      .explains = {Covariate::Temperature}};
  static ThermalDelay none() { return {.per_degree = 0_mm, .per_sensor_degree = 0_mm}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.quantity("per_degree", per_degree, millimetre, {-100.0, 100.0},
               "kappa_i, of range per degree Celsius of the illumination; positive: reads farther");
    v.quantity("per_sensor_degree", per_sensor_degree, millimetre, {-100.0, 100.0},
               "kappa_s, the same of the sensor");
    v.quantity("reference", reference, celsius, {-60.0, 150.0}, "T0, where the camera is right");
  }
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
