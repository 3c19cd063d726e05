// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// A warmer emitter is slower. The camera file's low pass of time constant τ₀ becomes one of
/// τ = τ₀ + κ (T − T₀), T the temperature of the illumination:
///     Pₙ → Pₙ · (1 + i n ω τ₀) / (1 + i n ω τ)
/// It delays the light, weakens it and changes the wiggling, all at once.
struct RiseDrift {
  Duration rise = 2_ns;
  Duration per_degree = 0.01_ns;
  Temperature reference = 25_degC;

  static constexpr About about{
      .name = "rise_drift",
      .summary = "the emitter's rise time drifts with its temperature: delay, loss and another wiggling",
      .reference = "first-order low pass of the emitter; the drift is the camera's own",
      .explains = {Covariate::Temperature}};
  static RiseDrift none() { return {.per_degree = 0_ns}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.quantity("rise", rise, nanosecond, {0.0, 1000.0}, "tau0, what the camera file says (rise_ns)");
    v.quantity("per_degree", per_degree, nanosecond, {-10.0, 10.0}, "kappa, per degree Celsius");
    v.quantity("reference", reference, celsius, {-60.0, 150.0}, "T0, where tau is tau0");
  }
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
