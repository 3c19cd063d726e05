// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/edge_filter.h"

#include "sim/effects/neighbours.h"

namespace toftwin::sim {

RangeImage EdgeFilter::apply(RangeImage image, const Conditions&, const Random&) const {
  if (limit >= none().limit) return image;
  const Image<float> before = image.range_m;
  rejectWhere(image, PixelFlag::Mixed, [&](int x, int y) {
    const float own = before(x, y);
    const float most = static_cast<float>(limit.in(metre)) + static_cast<float>(share) * own;
    bool jumps = false;
    forValidAround(before, x, y, 1,
                   [&](float range_m, int, int) { jumps |= std::abs(range_m - own) > most; });
    return jumps;
  });
  return image;
}

}  // namespace toftwin::sim
