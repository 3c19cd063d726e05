// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/clock_scale.h"

namespace toftwin::sim {

RangeImage ClockScale::apply(RangeImage image, const Conditions&, const Random&) const {
  const auto factor = static_cast<float>(1.0 + 1e-6 * ppm);
  if (factor == 1.0F) return image;
  for (float& range_m : image.range_m.pixels()) range_m *= factor;  // NaN stays NaN
  return image;
}

}  // namespace toftwin::sim
