// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// The crystal that all modulation comes from is off, or the firmware's speed of light is:
///     r → r (1 + s)
/// in proportion to the range and the same at every frequency. A decoder that takes another speed of
/// light (`decoder.speed_of_light_m_per_s`) has its own s; this one is the clock's.
struct ClockScale {
  double ppm = 100.0;

  static constexpr About about{
      .name = "clock_scale",
      .summary = "the clock is off: every range is too long or too short by the same share",
      .reference = "libfreenect2 takes 3e8 m/s for the speed of light: 692 ppm",
      .explains = {Covariate::Range}};
  static ClockScale none() { return {.ppm = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("ppm", ppm, {-10'000.0, 10'000.0}, "s in parts per million; positive: reads too far");
  }
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now,
                                 const Random& random) const;
};

}  // namespace toftwin::sim
