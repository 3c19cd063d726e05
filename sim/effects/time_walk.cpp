// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/time_walk.h"

#include <cmath>

#include "sim/images/rows.h"

namespace toftwin::sim {

RangeImage TimeWalk::apply(RangeImage image, const Conditions&, const Random&) const {
  const auto k_m = static_cast<float>(per_e_fold.in(metre));
  if (k_m == 0.0F) return image;
  const auto reference = static_cast<float>(reference_electrons);
  forRows(image.range_m.height(), [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      float* range_m = &image.range_m(0, y);
      const float* amplitude = &image.amplitude(0, y);
      for (int x = 0; x < image.range_m.width(); ++x) {
        if (amplitude[x] > 0.0F) range_m[x] -= k_m * std::log(amplitude[x] / reference);
      }
    }
  });
  return image;
}

}  // namespace toftwin::sim
