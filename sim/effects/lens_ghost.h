// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Light that is reflected twice between the lens' surfaces makes a faint second image, turned by half
/// a turn about a point m near the principal point:
///     P̃(p) = (1 − a) P(p) + a P(2m − p)
/// with phase and all, from the unclipped light, P linear between pixels. What lies beyond the image's edge is dark. On
/// a traced region only what the region sees is mirrored.
struct LensGhost {
  double share = 0.005;
  double right = 2.0, down = 1.0;  ///< of m from the principal point, pixels

  static constexpr About about{
      .name = "lens_ghost",
      .summary = "a faint second image, upside down, from reflections between the lens' surfaces",
      .reference = "S. Jamtsho, D. D. Lichti 2010 (scatter that a veil and a halo do not explain)",
      .explains = {Covariate::Amplitude, Covariate::Range, Covariate::Position, Covariate::Neighbours}};
  static LensGhost none() { return {.share = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("share", share, {0.0, 0.5}, "share a of the light that goes into the second image");
    v.number("right_px", right, {-1e4, 1e4},
             "the point m that it is turned about, from the principal point");
    v.number("down_px", down, {-1e4, 1e4}, "the same, downwards");
  }
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
