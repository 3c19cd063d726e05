// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// One raw exposure of each frequency is taken with the reference late:  θₖ → θₖ + ψ  for k = `step`.
/// With four steps that is an offset of ψ/4 and an error of ψ/4 with two cycles per turn. Acts on
/// the light because the samples no longer tell what another delay would have collected. A camera
/// file may list it once for each step.
struct StepPhase {
  int step = 1;
  Angle error = 1_deg;

  static constexpr About about{.name = "step_phase",
                               .summary = "the reference of one of the raw exposures is late",
                               .reference = "closed form in the page; two cycles per turn for four steps",
                               .explains = {Covariate::Range}};
  static StepPhase none() { return {.error = 0_rad}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("step", step, {0, 15}, "which raw exposure of each frequency; the first is 0");
    v.quantity("error", error, radian, {-3.2, 3.2}, "psi; positive: late");
  }
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
