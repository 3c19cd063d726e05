// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Firmware corrects the range for temperature, never quite. What it leaves:
///     r → r + c₁ (T − T₀) + c₂ (T − T₀)²
/// T the temperature of the illumination. Listed after a `thermal_delay` of κ_i, c₁ = −κ_i is firmware
/// that is right, and anything else what a camera shows that corrects itself.
struct ResidualDrift {
  Length per_degree = 0.1_mm;
  Length per_degree_squared = 0_mm;
  Temperature reference = 25_degC;

  static constexpr About about{
      .name = "residual_drift",
      .summary = "what the firmware's own temperature correction leaves, or takes off too much",
      .reference = "ifm O3R: its range limits vary with the illumination's temperature (ifm3d)",
      .explains = {Covariate::Temperature}};
  static ResidualDrift none() { return {.per_degree = 0_mm}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.quantity("per_degree", per_degree, millimetre, {-100.0, 100.0},
               "c1, per degree Celsius; positive: reads farther when warm");
    v.quantity("per_degree_squared", per_degree_squared, millimetre, {-10.0, 10.0},
               "c2, per square of degrees");
    v.quantity("reference", reference, celsius, {-60.0, 150.0}, "T0, where nothing is left");
  }
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now,
                                 const Random& random) const;
};

}  // namespace toftwin::sim
