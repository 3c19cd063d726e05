// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/bilateral_filter.h"

#include <vector>

#include "sim/effects/neighbours.h"

namespace toftwin::sim {

RangeImage BilateralFilter::apply(RangeImage image, const Conditions&, const Random&) const {
  if (sigma == 0.0) return image;
  const int reach = static_cast<int>(std::ceil(2.0 * sigma));
  const auto side = static_cast<std::size_t>(2 * reach + 1);
  std::vector<float> in_image;
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx)
      in_image.push_back(static_cast<float>(std::exp(-0.5 * (dx * dx + dy * dy) / (sigma * sigma))));
  }
  const auto steepness = static_cast<float>(0.5 / std::pow(sigma_range.in(metre), 2));
  const Image<float> before = image.range_m;
  replaceRanges(image.range_m, [&](int x, int y) {
    const float own = before(x, y);
    float sum = 0.0F, weights = 0.0F;
    forValidAround(before, x, y, reach, [&](float range_m, int dx, int dy) {
      const float away = range_m - own;  // the mean of differences is exact where there are none
      const float weight = in_image[static_cast<std::size_t>(dy + reach) * side +
                                    static_cast<std::size_t>(dx + reach)] *
                           std::exp(-steepness * away * away);
      sum += weight * away;
      weights += weight;
    });
    return own + sum / weights;
  });
  return image;
}

}  // namespace toftwin::sim
