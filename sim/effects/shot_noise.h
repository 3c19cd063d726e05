// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Each tap counts photo-electrons, which arrive independently: Poisson with the noise-free charge
/// as its mean, times `fano`. With M signal and A ambient electrons per sample in both taps
/// together and contrast m the phase of N samples then has
///     σ = √(2 (M + A) / N) / (m M)                                  for fano = 1
struct ShotNoise {
  double fano = 1.0;  ///< variance per mean

  static constexpr About about{
      .name = "shot_noise",
      .summary = "photo-electrons are counted: Poisson noise in every tap",
      .reference = "R. Lange, 3D time-of-flight distance measurement (2000), ch. 4",
      .explains = {Covariate::Ambient, Covariate::Exposure, Covariate::Amplitude, Covariate::Range,
                   Covariate::Frame}};
  static ShotNoise none() { return {.fano = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("fano", fano, {0.0, 10.0},
             "variance of a count divided by its mean: 1 for photons, 0 switches the noise off");
  }
  [[nodiscard]] Samples apply(Samples samples, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
