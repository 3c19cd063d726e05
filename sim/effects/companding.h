// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"
#include "sim/effects/mean_of_steps.h"

namespace toftwin::sim {

/// The Kinect v2's converter: the difference of the taps as 11 bits, sign and magnitude, in steps
/// that grow with the signal. Below 256 counts a step is one count; in each doubling above it is
/// twice as large:
///     step(m) = max(1, 2^⌊log₂ m⌋ / 128),   largest 16320
/// A larger difference has the code of minus zero, which means saturated: the pixel is flagged.
/// With one tap the sample itself is converted.
struct Companding {
  double counts_per_electron = 0.0026;

  NoiseOfCharge mean_over{};  ///< of each tap

  static constexpr About about{
      .name = "companding",
      .summary = "11-bit samples in steps that grow with the signal, and their code for saturation",
      .reference = "libfreenect2, libfreenect2.cpp (lookup table of the 11-bit code)",
      .explains = {Covariate::Exposure, Covariate::Amplitude, Covariate::Range}};
  static Companding none() { return {.counts_per_electron = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("counts_per_electron", counts_per_electron, {0.0, 1e3},
             "counts per electron of difference; 0: no steps");
  }
  [[nodiscard]] Samples apply(Samples samples, const Conditions& now, const Random& random) const;

  static constexpr float kLargest = 16320.0F;  ///< counts
};

}  // namespace toftwin::sim
