// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// A pixel on the edge of two surfaces flies between them, and few neighbours fly with it. A pixel is
/// rejected if fewer than `supporters` of its eight neighbours lie within `tolerance` + `share` · r of its
/// range; it becomes invalid and is flagged Mixed. Thin things go with the flying ones.
struct FlyingPixelFilter {
  int supporters = 3;
  Length tolerance = 20_mm;
  double share = 0.01;

  static constexpr About about{
      .name = "flying_pixel_filter",
      .summary = "pixels whose range too few neighbours share are invalid",
      .reference = "counting supporters; ifm3d's and Azure Kinect's filters reject the same pixels",
      .explains = {Covariate::Range, Covariate::Neighbours}};
  static FlyingPixelFilter none() { return {.supporters = 0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("supporters", supporters, {0, 8}, "neighbours that must agree; 0: no filter");
    v.quantity("tolerance", tolerance, millimetre, {0.0, 10'000.0}, "agreeing at range 0");
    v.number("share", share, {0.0, 1.0}, "what the tolerance grows by, as a share of the range");
  }
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now,
                                 const Random& random) const;
};

}  // namespace toftwin::sim
