// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Each range becomes the median of the valid ranges in a square window around it, the mean of the two
/// middle ones where their number is even. Removes single outliers and keeps straight edges; rounds
/// corners. Noise of neighbours is correlated afterwards. Invalid pixels stay invalid.
struct MedianFilter {
  int reach = 1;

  static constexpr About about{
      .name = "median_filter",
      .summary = "each range becomes the median of its neighbourhood",
      .reference = "J. W. Tukey 1977; variance of a median of nine normals 0.1661",
      .explains = {Covariate::Range, Covariate::Neighbours}};
  static MedianFilter none() { return {.reach = 0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("reach", reach, {0, 5}, "window of 2 reach + 1 pixels across; 0: no filter");
  }
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now,
                                 const Random& random) const;
};

}  // namespace toftwin::sim
