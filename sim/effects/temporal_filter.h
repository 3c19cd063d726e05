// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// A running mean over frames that forgets:
///     r → r′ + α (r − r′),   r′ what the camera gave for this pixel a frame ago
/// where both are valid and no farther apart than `jump` (a moving edge is taken as it is). Noise falls
/// to √(α / (2 − α)) of itself and becomes correlated in time; slow motion lags behind by (1 − α)/α
/// frames. Must be the last effect of a camera file, for r′ is what left the camera.
struct TemporalFilter {
  double new_share = 0.4;
  Length jump = 50_mm;

  static constexpr About about{
      .name = "temporal_filter",
      .summary = "a running mean over frames: less noise, and motion that lags behind",
      .reference = "first-order recursive filter; librealsense's temporal filter is of this kind",
      .explains = {Covariate::Range, Covariate::History}};
  static TemporalFilter none() { return {.new_share = 1.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("new_share", new_share, {0.01, 1.0}, "alpha, weight of the new frame; 1: no filter");
    v.quantity("jump", jump, millimetre, {0.0, 1e6}, "larger changes are taken at once");
  }
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now,
                                 const Random& random) const;
};

}  // namespace toftwin::sim
