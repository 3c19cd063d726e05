// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Each frequency has a phase offset of its own, which the factory's calibration did not take off:
///     Pₙ → Pₙ · exp(−i n p_f)
/// What a decoder makes of it depends on how it joins the frequencies: a Kinect v2 turns every radian
/// at any frequency into 110.5 mm, and a large one into another cycle.
struct FrequencyOffset {
  Angle first = 0.02_rad, second = 0_rad, third = 0_rad;

  static constexpr About about{
      .name = "frequency_offset",
      .summary = "a constant phase offset of each modulation frequency",
      .reference = "TI OPT8241: one phase correction per frequency; libfreenect2's phase sum",
      .explains = {}};
  static FrequencyOffset none() { return {.first = 0_rad}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.quantity("first", first, radian, {-7.0, 7.0},
               "of the camera file's first modulation; positive: reads farther");
    v.quantity("second", second, radian, {-7.0, 7.0}, "of its second, if it has one");
    v.quantity("third", third, radian, {-7.0, 7.0}, "of its third");
  }
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
