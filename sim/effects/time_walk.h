// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Weak signals seem to come later: demodulation contrast, comparators and residual charge shift the
/// range with the amplitude,
///     r → r − k ln(A / A₀)
/// A the decoded amplitude in electrons, so exposure counts as reflectivity does. Monotone, without
/// cycles: what tells it from offsets and internal reflections.
struct TimeWalk {
  Length per_e_fold = 1_mm;
  double reference_electrons = 1e4;

  static constexpr About about{
      .name = "time_walk",
      .summary = "the range goes with the logarithm of the amplitude: dark things seem farther",
      .reference = "M. Lindner, A. Kolb 2007 (intensity-related distance error)",
      .explains = {Covariate::Exposure, Covariate::Amplitude}};
  static TimeWalk none() { return {.per_e_fold = 0_mm}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.quantity("per_e_fold", per_e_fold, millimetre, {-1000.0, 1000.0},
               "k; positive: an amplitude smaller by the factor e reads this much farther");
    v.number("reference_electrons", reference_electrons, {1e-3, 1e12}, "A0, where the range is right");
  }
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now,
                                 const Random& random) const;
};

}  // namespace toftwin::sim
