// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned_range.h"

#include <cmath>

#include "sim/images/rows.h"

namespace toftwin::sim {

RangeImage LearnedRange::apply(RangeImage image, const Conditions& now, const Random&) const {
  if (knots.empty()) return image;
  const auto along = [&](Over what) {
    return [&image, &now, what, same = ofFrame(what, now.moment)](int x, int y) {
      if (!std::isnan(same)) return same;
      if (what == Over::Range) return static_cast<double>(image.range_m(x, y));
      if (what == Over::Amplitude) return static_cast<double>(image.amplitude(x, y));
      return ofPlace(what, now, x, y);
    };
  };
  const auto x_at = along(over), y_at = along(and_over);
  forRows(image.range_m.height(), [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      for (int x = 0; x < image.range_m.width(); ++x) {
        const double at_x = x_at(x, y), at_y = y_at(x, y);  // of the image as it came
        const double offset = offset_mm(at_x, at_y), gain = gain_percent(at_x, at_y);
        if (std::isnan(offset) || std::isnan(gain)) continue;
        image.range_m(x, y) += static_cast<float>(1e-3 * offset);
        if (gain != 0.0) image.amplitude(x, y) *= static_cast<float>(1.0 + 1e-2 * gain);
      }
    }
  });
  return image;
}

}  // namespace toftwin::sim
