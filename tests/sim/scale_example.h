// SPDX-License-Identifier: Apache-2.0
// The example of docs/add-an-effect.md, word for word; docs_test compares, effect_laws_test obeys.
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

struct Scale {
  double ppm = 700.0;

  static constexpr About about{
      .name = "scale",
      .summary = "the clock is off: every range is too long or too short by the same share",
      .reference = "libfreenect2 takes 3e8 m/s for the speed of light",
      .explains = {Covariate::Range}};
  static Scale none() { return {.ppm = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("ppm", ppm, {-10'000.0, 10'000.0}, "parts per million; positive: reads too far");
  }
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now,
                                 const Random& random) const;
};

inline RangeImage Scale::apply(RangeImage image, const Conditions&, const Random&) const {
  const auto factor = static_cast<float>(1.0 + 1e-6 * ppm);
  if (factor == 1.0F) return image;
  for (float& range_m : image.range_m.pixels()) range_m *= factor;  // NaN stays NaN
  return image;
}

}  // namespace toftwin::sim
