// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Light from neighbours that measurements showed and no other effect explains, as a kernel of squares:
///     P̃ = P + Σₖ sₖ ⟨P⟩ₖ
/// for each frequency's and harmonic's phasor and for the unmodulated light, with ⟨P⟩ₖ the mean over the
/// pixels within rₖ columns and rows, as far as the image goes. A share may be less than nothing: that much
/// of a wider square is missing there. What `toftwin discover` writes for scatter that has no name yet. On a
/// traced region only what the region sees comes from neighbours.
struct LearnedNeighbours {
  std::vector<double> reaches_px{1.0, 15.0};
  std::vector<double> shares_percent{0.5, 1.0};

  static constexpr About about{
      .name = "learned_neighbours",
      .summary = "light from neighbours learned from measurements: a kernel of squares",
      .reference = "docs/discover-campaigns.md",
      .explains = {Covariate::Amplitude, Covariate::Range, Covariate::Neighbours}};
  static LearnedNeighbours none() { return {.shares_percent = {0.0, 0.0}}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.numbers("reaches_px", reaches_px, {0.0, 1e6}, "r of each square, whole pixels; none: nothing is done");
    v.numbers("shares_percent", shares_percent, {-100.0, 100.0}, "s of each square");
  }
  /// What no single key can say of what is wrong, or nothing.
  [[nodiscard]] std::string problem() const;
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
