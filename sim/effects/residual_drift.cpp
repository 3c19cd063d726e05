// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/residual_drift.h"

#include "sim/effects/temperature.h"

namespace toftwin::sim {

RangeImage ResidualDrift::apply(RangeImage image, const Conditions& now, const Random&) const {
  const double degrees = degreesAbove(reference, now.moment, "illumination");
  const Length left = per_degree * degrees + per_degree_squared * (degrees * degrees);
  const auto left_m = static_cast<float>(left.in(metre));
  if (left_m == 0.0F) return image;
  for (float& range_m : image.range_m.pixels()) range_m += left_m;  // NaN stays NaN
  return image;
}

}  // namespace toftwin::sim
