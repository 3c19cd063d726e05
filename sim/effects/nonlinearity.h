// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// What a tap hands out is not quite in proportion to its charge:
///     S → S − q S² − κ S³
/// The square turns no phase for four steps (it cancels) and three cycles for three; the cube turns four
/// cycles in proportion to the square of the amplitude.
struct Nonlinearity {
  double quadratic = 0.0;     ///< q, per electron
  double cubic = 1e-13;  ///< κ, per electron²

  static constexpr About about{
      .name = "nonlinearity",
      .summary = "the charge read is less than in proportion to the light, before the well is full",
      .reference = "EMVA Standard 1288, release 4.0, section 8 (linearity); closed form in the page",
      .explains = {Covariate::Ambient, Covariate::Exposure, Covariate::Amplitude, Covariate::Range}};
  static Nonlinearity none() { return {.cubic = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("quadratic_per_electron", quadratic, {-1e-3, 1e-3}, "q: 1e-8 takes 1 % off a million");
    v.number("cubic_per_electron2", cubic, {-1e-6, 1e-6}, "kappa: 1e-14 takes 1 % off a million");
  }
  [[nodiscard]] Samples apply(Samples samples, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
