// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Nothing at an edge is trusted: a pixel becomes invalid and is flagged Mixed if any of its eight
/// neighbours lies farther from it than `limit` + `share` · r. Both sides of each edge go, a pixel wide
/// each, flying ones among them.
struct EdgeFilter {
  Length limit = 50_mm;
  double share = 0.02;

  static constexpr About about{
      .name = "edge_filter",
      .summary = "pixels beside a jump of the range are invalid",
      .reference = "libfreenect2's edge-aware filter rejects on jumps of the same kind",
      .explains = {Covariate::Range, Covariate::Neighbours}};
  static EdgeFilter none() { return {.limit = 1e6_m}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.quantity("limit", limit, millimetre, {0.0, 1e9}, "largest jump at range 0; 1e9: no filter");
    v.number("share", share, {0.0, 1.0}, "what the limit grows by, as a share of the range");
  }
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now,
                                 const Random& random) const;
};

}  // namespace toftwin::sim
