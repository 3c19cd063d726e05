// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Each range becomes the weighted mean of the valid ranges around it, near in the image and in range:
///     r′(p) = Σ_q w r(q) / Σ_q w,   w = exp(−|p − q|²/2σ² − (r(p) − r(q))²/2σ_r²)
/// out to two σ. Smooths surfaces and keeps edges higher than a few σ_r. Noise of neighbours is
/// correlated afterwards. Invalid pixels stay invalid.
struct BilateralFilter {
  double sigma = 1.0;  ///< pixels
  Length sigma_range = 30_mm;

  static constexpr About about{
      .name = "bilateral_filter",
      .summary = "each range becomes a mean over neighbours of similar range: smooth, with edges",
      .reference = "C. Tomasi, R. Manduchi 1998",
      .explains = {Covariate::Range, Covariate::Neighbours}};
  static BilateralFilter none() { return {.sigma = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("sigma_px", sigma, {0.0, 5.0}, "sigma, in the image; 0: no filter");
    v.quantity("sigma_range", sigma_range, millimetre, {0.01, 1e6}, "sigma_r, of the range");
  }
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now,
                                 const Random& random) const;
};

}  // namespace toftwin::sim
