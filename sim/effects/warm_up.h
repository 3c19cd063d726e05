// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// A camera that was just switched on reads wrong by
///     δ(t) = −a₁ e^(−t/τ₁) − a₂ e^(−t/τ₂)
/// with t the time since power-on: calibrated warm, off by −(a₁ + a₂) when cold, approached as two
/// masses (LED driver, housing) warm up. Positive a: a cold camera reads too near. Where the time
/// since power-on is unknown the camera counts as warm.
struct WarmUp {
  Length fast = 3_mm;
  Duration fast_time = 120_s;
  Length slow = 5_mm;
  Duration slow_time = 900_s;

  static constexpr About about{
      .name = "warm_up",
      .summary = "drift after power-on: two exponentials that end at zero",
      .reference = "Schuetz & Groneberg, Fig. 4; Wasenmueller & Stricker 2016 (Kinect v2, 25 min)",
      .explains = {Covariate::Time}};
  static WarmUp none() { return {.fast = 0_mm, .slow = 0_mm}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.quantity("fast", fast, millimetre, {-1000.0, 1000.0},
               "a1, how much the fast part reads too near when cold");
    v.quantity("fast_time", fast_time, second, {1.0, 1e5}, "tau1");
    v.quantity("slow", slow, millimetre, {-1000.0, 1000.0}, "a2, the same for the slow part");
    v.quantity("slow_time", slow_time, second, {1.0, 1e5}, "tau2");
  }
  /// δ at a time since power-on.
  [[nodiscard]] Length drift(Duration since_power_on) const;
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now,
                                 const Random& random) const;
};

}  // namespace toftwin::sim
