// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/flying_pixel_filter.h"

#include "sim/effects/neighbours.h"

namespace toftwin::sim {

RangeImage FlyingPixelFilter::apply(RangeImage image, const Conditions&, const Random&) const {
  if (supporters == 0) return image;
  const Image<float> before = image.range_m;
  rejectWhere(image, PixelFlag::Mixed, [&](int x, int y) {
    const float own = before(x, y);
    const float near = static_cast<float>(tolerance.in(metre)) + static_cast<float>(share) * own;
    int agreeing = -1;  // it agrees with itself
    forValidAround(before, x, y, 1,
                   [&](float range_m, int, int) { agreeing += std::abs(range_m - own) <= near; });
    return agreeing < supporters;
  });
  return image;
}

}  // namespace toftwin::sim
