// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// The camera hands out no range where the amplitude, averaged over the frequencies, is below a
/// minimum: such pixels become invalid and are flagged LowAmplitude. The decoder's own rule
/// (`minimum_amplitude_electrons`) asks each frequency; this one comes after it.
struct LowAmplitudeFilter {
  double minimum_electrons = 300.0;

  static constexpr About about{
      .name = "low_amplitude_filter",
      .summary = "pixels whose mean amplitude is too low are invalid",
      .reference = "libfreenect2's sum of amplitudes; ifm3d's MinimumAmplitude",
      .explains = {Covariate::Exposure, Covariate::Amplitude}};
  static LowAmplitudeFilter none() { return {.minimum_electrons = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("minimum_electrons", minimum_electrons, {0.0, 1e12}, "lower amplitudes are invalid");
  }
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now,
                                 const Random& random) const;
};

}  // namespace toftwin::sim
