// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// A floor under a camera's noise that neither light nor read-out explains:  r → r + σ z,
/// independent in every pixel and frame. A stand-in for a black box (clock and illumination jitter,
/// filters), fitted, not derived.
struct RangeNoise {
  Length sigma = 1_mm;

  static constexpr About about{
      .name = "range_noise",
      .summary =
          "a floor under the noise, the same for every pixel: a stand-in, fitted to a device",
      .reference = "none: measured as what remains of the variance at short range",
      .explains = {Covariate::Frame}};
  static RangeNoise none() { return {.sigma = 0_mm}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.quantity("sigma", sigma, millimetre, {0.0, 1000.0}, "standard deviation");
  }
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now,
                                 const Random& random) const;
};

}  // namespace toftwin::sim
