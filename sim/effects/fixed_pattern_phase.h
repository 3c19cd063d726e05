// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// The demodulation signal reaches each pixel a little early or late: a phase offset p₀ per pixel
/// and frequency that never changes. Harmonic n turns n times as far:
///     Pₙ → Pₙ · exp(−i n p₀(x, y, f)),  p₀ normal with standard deviation `sigma`
/// `device` chooses which of all cameras of this make it is.
struct FixedPatternPhase {
  Angle sigma = 0.02_rad;
  std::uint32_t device = 1;

  static constexpr About about{
      .name = "fixed_pattern_phase",
      .summary = "a constant phase offset of each pixel at each frequency",
      .reference = "the p0 tables in a Kinect v2's memory, as libfreenect2 reads them",
      .explains = {Covariate::Position}};
  static FixedPatternPhase none() { return {.sigma = 0_rad}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.quantity("sigma", sigma, radian, {0.0, 3.2}, "standard deviation over the pixels");
    v.number("device", device, {0.0, 4294967295.0},
             "which camera of this make: another number, another pattern");
  }
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
