// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// One of the raw exposures, in one tap, is amplified more:  Sₖ → Sₖ (1 + γ)  for k = `step`, of every
/// frequency. The unmodulated charge B comes with it, so the phase error has a cycle in proportion to
/// B/A, ambient light included, and two cycles that no amplitude changes. A camera file may list it once
/// for each step.
struct SampleGain {
  int step = 0;
  int tap = 0;
  double gain = 0.01;

  static constexpr About about{
      .name = "sample_gain",
      .summary = "one raw exposure is amplified more: ambient light then shifts the range",
      .reference = "closed form in the page",
      .explains = {Covariate::Ambient, Covariate::Amplitude, Covariate::Range}};
  static SampleGain none() { return {.gain = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("step", step, {0, 15}, "which raw exposure of each frequency; the first is 0");
    v.number("tap", tap, {0, 1}, "which tap of the pixel");
    v.number("gain", gain, {-0.9, 10.0}, "gamma: 0.01 is 1 % too much");
  }
  [[nodiscard]] Samples apply(Samples samples, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
