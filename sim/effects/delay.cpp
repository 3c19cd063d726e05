// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/delay.h"

namespace toftwin::sim {

RangeImage Delay::apply(RangeImage image, const Conditions&, const Random&) const {
  const auto offset_m = static_cast<float>(offset.in(metre));
  if (offset_m == 0.0F) return image;
  for (float& range_m : image.range_m.pixels()) range_m += offset_m;  // NaN stays NaN
  return image;
}

}  // namespace toftwin::sim
