// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Pixels that look farther out or in than the camera file's lens says, which measurements showed and no
/// other effect explains, as a table over the radius:
///     P̃(p) = P(p + s(r) e),   r = |p − c|,  e = (p − c)/r,  c the principal point
/// linear between four pixels and between the knots of s, which is constant beyond them. What `toftwin
/// discover` writes for a lens that has no name yet.
struct LearnedShift {
  std::vector<double> radii_px{0.0, 100.0};
  std::vector<double> outward_px{0.0, 1.0};

  static constexpr About about{
      .name = "learned_shift",
      .summary =
          "pixels that look farther out than the lens says, learned from measurements: a table over the "
          "radius",
      .reference = "docs/discover-campaigns.md",
      .explains = {Covariate::Amplitude, Covariate::Range, Covariate::Position, Covariate::Neighbours}};
  static LearnedShift none() { return {.outward_px = {0.0, 0.0}}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.numbers("radii_px", radii_px, {0.0, 1e6}, "values of r, ascending; none: nothing is done");
    v.numbers("outward_px", outward_px, {-1000.0, 1000.0}, "s at each of them");
  }
  /// What no single key can say of what is wrong, or nothing.
  [[nodiscard]] std::string problem() const;
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
