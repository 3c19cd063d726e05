// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// A circuit in two-tap pixels takes the same charge C from both taps while they fill, so that sunlight
/// does not fill the wells, and costs some contrast:
///     C = min(share · min(a, b), limit),   a − b → (a − b) (1 − λ C)
/// Their sum loses 2C. The removed charge's shot noise stays: list it after `shot_noise` and before
/// `saturation`. Pixels with one tap have no such circuit and stay as they are.
struct AmbientSuppression {
  double share = 0.9;
  double limit_electrons = 1e7;
  double contrast_loss = 1e-7;  ///< λ, per electron

  static constexpr About about{
      .name = "ambient_suppression",
      .summary = "two-tap pixels get rid of common charge, which keeps the wells and costs contrast",
      .reference = "T. Moeller et al. 2005 (PMD's suppression of background illumination)",
      .explains = {Covariate::Ambient, Covariate::Exposure, Covariate::Amplitude, Covariate::Range}};
  static AmbientSuppression none() { return {.share = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("share", share, {0.0, 1.0}, "of the emptier tap's charge that is taken from both");
    v.number("limit_electrons", limit_electrons, {0.0, 1e12}, "the most that the circuit can take");
    v.number("contrast_loss_per_electron", contrast_loss, {0.0, 1e-3},
             "lambda, share of the difference lost per electron taken; at most all is lost");
  }
  [[nodiscard]] Samples apply(Samples samples, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
