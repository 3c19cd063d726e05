// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Light from neighbours that measurements showed and no other effect explains, as a kernel of squares and lines:
///     P̃ = P + Σₖ sₖ ⟨P⟩ₖ + s_row ⟨P⟩_row + s_column ⟨P⟩_column
/// for each frequency's and harmonic's phasor and for the unmodulated light, with ⟨P⟩ₖ the mean over the pixels within
/// rₖ columns and rows, as far as the image goes, ⟨P⟩_row over those of the pixel's row, which share wires, and
/// ⟨P⟩_column over those of its column. A share may be less than nothing: that much of a wider square is missing there.
/// What `toftwin discover` writes for scatter that has no name yet. On a traced region only what the region sees comes
/// from neighbours.
struct LearnedNeighbours {
  std::vector<double> reaches_px{1.0, 15.0};
  std::vector<double> shares_percent{0.5, 1.0};
  double row_percent = 0.0, column_percent = 0.0;

  static constexpr About about{
      .name = "learned_neighbours",
      .summary = "light from neighbours learned from measurements: a kernel of squares and lines",
      .reference = "docs/discover-campaigns.md",
      .explains = {Covariate::Amplitude, Covariate::Range, Covariate::Neighbours}};
  static LearnedNeighbours none() { return {.shares_percent = {0.0, 0.0}}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.numbers("reaches_px", reaches_px, {0.0, 1e6}, "r of each square, whole pixels; none: no squares");
    v.numbers("shares_percent", shares_percent, {-100.0, 100.0}, "s of each square");
    v.number("row_percent", row_percent, {-100.0, 100.0}, "s of the pixel's row");
    v.number("column_percent", column_percent, {-100.0, 100.0}, "s of its column");
  }
  /// What no single key can say of what is wrong, or nothing.
  [[nodiscard]] std::string problem() const;
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
