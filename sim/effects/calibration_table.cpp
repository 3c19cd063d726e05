// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/calibration_table.h"

#include <algorithm>
#include <cmath>

#include "sim/images/rows.h"

namespace toftwin::sim {

std::string CalibrationTable::problem() const {
  if (offsets_mm.size() <= kMostKnots) return "";
  return "has " + std::to_string(offsets_mm.size()) + " knots in offsets_mm; it can have at most " +
         std::to_string(kMostKnots);
}

double CalibrationTable::offset_mm(double range_m) const {
  if (offsets_mm.empty()) return 0.0;
  const auto last = static_cast<double>(offsets_mm.size() - 1);
  const double at = std::clamp((range_m * metre - first) / spacing, 0.0, last);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, offsets_mm.size() - 1);
  return std::lerp(offsets_mm[below], offsets_mm[above], at - std::floor(at));
}

RangeImage CalibrationTable::apply(RangeImage image, const Conditions&, const Random&) const {
  if (offsets_mm.empty()) return image;
  forRows(image.range_m.height(), [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      for (int x = 0; x < image.range_m.width(); ++x) {
        float& range_m = image.range_m(x, y);
        if (std::isnan(range_m)) continue;
        range_m += static_cast<float>(1e-3 * offset_mm(static_cast<double>(range_m)));
      }
    }
  });
  return image;
}

}  // namespace toftwin::sim
