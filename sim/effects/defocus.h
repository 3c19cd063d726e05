// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// The lens images a point not to a point but to a spot: a disc (out of focus) smeared by a Gaussian
/// (diffraction, aberrations, the pixel's own neighbours). All light stays:
///     P̃ = K * P,   K = disc of radius R * Gaussian of standard deviation σ
/// for every phasor and the unmodulated light. Pixels at an edge become mixtures of both sides, whose
/// range may lie between or beyond them. The image's border continues outwards.
struct Defocus {
  double radius = 0.0;  ///< pixels
  double sigma = 0.5;   ///< pixels

  static constexpr About about{
      .name = "defocus",
      .summary = "a point becomes a spot of a disc and a Gaussian: softer edges, more flying pixels",
      .reference = "M. Born, E. Wolf: Principles of Optics, chapter 8 (diffraction)",
      .explains = {Covariate::Amplitude, Covariate::Range, Covariate::Neighbours}};
  static Defocus none() { return {.sigma = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("radius_px", radius, {0.0, 10.0}, "R, of the disc that a point out of focus makes");
    v.number("sigma_px", sigma, {0.0, 3.0}, "sigma, of the Gaussian");
  }
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
