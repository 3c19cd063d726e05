// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// A pixel does not forget at once: part of the charge of the raw exposure before, and of the same one a
/// frame ago, is still there.
///     S_j → S_j + a S_{j−1} + b S_j′,   j in the order taken, ′ the frame before
/// The first raw exposure follows the last of the frame before. What is left behind is taken free of
/// noise. Without a frame before (the first one, or another region) only the frame's own memory acts.
struct Lag {
  double exposure_share = 0.002;
  double frame_share = 0.002;

  static constexpr About about{
      .name = "lag",
      .summary = "charge of the raw exposure and of the frame before is still in the pixel",
      .reference = "EMVA Standard 1288, release 4.0, section 2 (the linear model, which it breaks)",
      .explains = {Covariate::Ambient, Covariate::Amplitude, Covariate::Range, Covariate::History}};
  static Lag none() { return {.exposure_share = 0.0, .frame_share = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("exposure_share", exposure_share, {0.0, 0.5}, "a, of the raw exposure before");
    v.number("frame_share", frame_share, {0.0, 0.5}, "b, of the same raw exposure a frame before");
  }
  [[nodiscard]] Samples apply(Samples samples, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
