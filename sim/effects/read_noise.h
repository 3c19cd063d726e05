// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// The electronics between a tap and its number add Gaussian noise that knows nothing of the light:
///     S → S + σ z
struct ReadNoise {
  double sigma_electrons = 20.0;

  static constexpr About about{
      .name = "read_noise",
      .summary = "Gaussian noise of reset, amplifier and converter, the same in the dark",
      .reference = "EMVA Standard 1288, release 4.0, section 3 (dark noise)",
      // In electrons it depends on nothing but chance; against the signal it weighs less the more
      // of that there is.
      .explains = {Covariate::Exposure, Covariate::Amplitude, Covariate::Frame}};
  static ReadNoise none() { return {.sigma_electrons = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("sigma_electrons", sigma_electrons, {0.0, 1e5},
             "standard deviation, per tap and sample");
  }
  [[nodiscard]] Samples apply(Samples samples, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
