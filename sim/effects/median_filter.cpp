// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/median_filter.h"

#include <algorithm>
#include <array>

#include "sim/effects/neighbours.h"

namespace toftwin::sim {

RangeImage MedianFilter::apply(RangeImage image, const Conditions&, const Random&) const {
  if (reach == 0) return image;
  const Image<float> before = image.range_m;
  replaceRanges(image.range_m, [&](int x, int y) {
    std::array<float, 11 * 11> window{};
    std::size_t count = 0;
    forValidAround(before, x, y, reach, [&](float range_m, int, int) { window[count++] = range_m; });
    const auto middle = window.begin() + static_cast<std::ptrdiff_t>(count / 2);
    std::nth_element(window.begin(), middle, window.begin() + static_cast<std::ptrdiff_t>(count));
    if (count % 2 != 0) return *middle;
    return 0.5F * (*middle + *std::max_element(window.begin(), middle));
  });
  return image;
}

}  // namespace toftwin::sim
