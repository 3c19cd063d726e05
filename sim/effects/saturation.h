// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// A tap holds so much charge and no more:  S → min(S, full well). A pixel that lost charge in any
/// sample is flagged as saturated; what decoding does with it is the decoder's.
struct Saturation {
  double full_well_electrons = 50'000.0;

  static constexpr About about{
      .name = "saturation",
      .summary = "a tap's well is full: charge above it is lost and the pixel is flagged",
      .reference = "EMVA Standard 1288, release 4.0, section 2 (saturation capacity)",
      .explains = {Covariate::Ambient, Covariate::Exposure, Covariate::Amplitude,
                   Covariate::Range}};
  static Saturation none() { return {.full_well_electrons = kNoWell}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("full_well_electrons", full_well_electrons, {1.0, kNoWell}, "capacity of one tap");
  }
  [[nodiscard]] Samples apply(Samples samples, const Conditions& now, const Random& random) const;

  static constexpr double kNoWell = 1e30;
};

}  // namespace toftwin::sim
