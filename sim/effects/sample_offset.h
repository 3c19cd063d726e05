// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// One of the raw exposures, in one tap, has a constant offset:  Sₖ → Sₖ + o  for k = `step`, of every
/// frequency. The same charge whatever the light, so a dark frame shows it, and the phase error goes with
/// 1/A, once per turn. A camera file may list it once for each step.
struct SampleOffset {
  int step = 0;
  int tap = 0;
  double electrons = 20.0;

  static constexpr About about{
      .name = "sample_offset",
      .summary = "one raw exposure has a constant charge too much: an error that grows as light fades",
      .reference = "closed form in the page; dark offset of EMVA Standard 1288",
      .explains = {Covariate::Exposure, Covariate::Amplitude}};
  static SampleOffset none() { return {.electrons = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("step", step, {0, 15}, "which raw exposure of each frequency; the first is 0");
    v.number("tap", tap, {0, 1}, "which tap of the pixel");
    v.number("electrons", electrons, {-1e9, 1e9}, "o, positive: too much");
  }
  [[nodiscard]] Samples apply(Samples samples, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
