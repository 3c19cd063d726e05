// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Light from the mirrored place of the image that measurements showed and no other effect explains, as a
/// kernel of squares about that place:
///     P̃(p) = P(p) + Σₖ sₖ ⟨P⟩ₖ(2m − p)
/// for each frequency's and harmonic's phasor and for the unmodulated light, with ⟨P⟩ₖ as in
/// LearnedNeighbours, linear between pixels, and m near the principal point. What lies beyond the image's
/// edge is dark. A second image is seldom sharp, so that several squares hold what one mirrored pixel does
/// not. What `toftwin discover` writes for a ghost image that has no name yet. On a traced region only what
/// the region sees is mirrored.
struct LearnedMirror {
  std::vector<double> reaches_px{0.0, 5.0};
  std::vector<double> shares_percent{0.5, 0.5};
  double right = 2.0, down = 1.0;  ///< of m from the principal point, pixels

  static constexpr About about{
      .name = "learned_mirror",
      .summary = "light from the mirrored place of the image learned from measurements: a kernel of squares",
      .reference = "docs/discover-campaigns.md",
      .explains = {Covariate::Amplitude, Covariate::Range, Covariate::Position, Covariate::Neighbours}};
  static LearnedMirror none() { return {.shares_percent = {0.0, 0.0}}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.numbers("reaches_px", reaches_px, {0.0, 1e6}, "r of each square, whole pixels; none: nothing is done");
    v.numbers("shares_percent", shares_percent, {-100.0, 100.0}, "s of each square");
    v.number("right_px", right, {-1e4, 1e4},
             "the point m that it is mirrored about, from the principal point");
    v.number("down_px", down, {-1e4, 1e4}, "the same, downwards");
  }
  /// What no single key can say of what is wrong, or nothing.
  [[nodiscard]] std::string problem() const;
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
