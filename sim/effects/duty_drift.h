// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// The driver of a square-wave emitter switches off early or late as it warms up, at the same peak
/// power: the duty cycle D₀ of the camera file becomes D = D₀ + κ (T − T₀). With the share e of the
/// change at the falling edge the light's middle moves by (e − ½)(D − D₀) of a period:
///     Pₙ → Pₙ · sin(nπD) / sin(nπD₀) · exp(−2πi n (e − ½)(D − D₀)),   unmodulated → · D/D₀
/// Harmonics that the nominal waveform lacks stay absent.
struct DutyDrift {
  double duty = 0.5;
  double per_degree = 0.0005;
  double falling_edge = 1.0;
  Temperature reference = 25_degC;

  static constexpr About about{
      .name = "duty_drift",
      .summary = "the duty cycle of a square-wave emitter drifts with its temperature",
      .reference = "Fourier coefficients of a rectangle, sin(n pi D) / n pi",
      .explains = {Covariate::Temperature}};
  static DutyDrift none() { return {.per_degree = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("duty", duty, {0.01, 0.99}, "D0, what the camera file says (emitted_duty)");
    v.number("per_degree", per_degree, {-0.1, 0.1}, "kappa, share of a period per degree Celsius");
    v.number("falling_edge", falling_edge, {0.0, 1.0},
             "share of the change at the falling edge; 0.5: the middle stays");
    v.quantity("reference", reference, celsius, {-60.0, 150.0}, "T0, where D is D0");
  }
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
