// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// A little of the camera's own light reaches the pixels inside the housing or from the window,
/// whatever the scene:
///     Pₙ → Pₙ + R exp(−i 4π n f r₀ / c),   unmodulated → + R
/// with radiance R and half the internal way r₀. It grows with exposure and emitter as the signal does,
/// so the error R/L goes with the pixel's own radiance L, once per turn of the phase.
struct InternalReflection {
  double radiance = 2e-4;  ///< W/(m² sr), at the lens
  Length half_way = 30_mm;

  static constexpr About about{
      .name = "internal_reflection",
      .summary = "the camera's own light from housing and window, the same in every pixel",
      .reference = "arXiv 2511.01874 (internal scattering of indirect time of flight)",
      .explains = {Covariate::Amplitude, Covariate::Range}};
  static InternalReflection none() { return {.radiance = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("radiance_w_per_m2_sr", radiance, {0.0, 1e3},
             "R, as if the scene had it: a white wall at 1 m lit by 1 W has about 0.08");
    v.quantity("half_way", half_way, millimetre, {0.0, 10'000.0},
               "r0, half the way that the light takes inside");
  }
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
