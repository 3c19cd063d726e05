// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"
#include "sim/effects/mean_of_steps.h"

namespace toftwin::sim {

/// The converter gives whole steps:  S → q · round(S / q), per tap, half a step to even.
struct Quantisation {
  double step_electrons = 10.0;

  NoiseOfCharge mean_over{};  ///< of each tap

  static constexpr About about{
      .name = "quantisation",
      .summary = "the converter's whole steps",
      .reference = "EMVA Standard 1288, release 4.0, section 2.3 (variance q²/12)",
      .explains = {Covariate::Ambient, Covariate::Exposure, Covariate::Amplitude,
                   Covariate::Range}};
  static Quantisation none() { return {.step_electrons = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("step_electrons", step_electrons, {0.0, 1e6}, "electrons per step; 0: no steps");
  }
  [[nodiscard]] Samples apply(Samples samples, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
