// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Less light reaches the corners of the chip:  all light · cos^m θ, θ the angle between the pixel's ray
/// and the lens' axis (of the pinhole: distortion left out). m = 4 is the natural law of a thin lens;
/// what the emitter does not light is the emitter's (`lobe_exponent`). Ranges stay; noise grows outwards.
struct Vignetting {
  double exponent = 4.0;

  static constexpr About about{
      .name = "vignetting",
      .summary = "the lens passes less light off its axis: weaker and noisier corners",
      .reference = "M. Born, E. Wolf: Principles of Optics, section 4.8 (cos^4 law)",
      .explains = {Covariate::Position}};
  static Vignetting none() { return {.exponent = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("exponent", exponent, {0.0, 20.0}, "m; 4: the natural law; 0: none");
  }
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
