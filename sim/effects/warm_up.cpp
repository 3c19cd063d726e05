// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/warm_up.h"

#include <cmath>

namespace toftwin::sim {

Length WarmUp::drift(Duration since_power_on) const {
  return -(fast * std::exp(-(since_power_on / fast_time)) +
           slow * std::exp(-(since_power_on / slow_time)));
}

RangeImage WarmUp::apply(RangeImage image, const Conditions& now, const Random&) const {
  if (!now.moment.since_power_on) return image;
  const auto drift_m = static_cast<float>(drift(*now.moment.since_power_on).in(metre));
  if (drift_m == 0.0F) return image;
  for (float& range_m : image.range_m.pixels()) range_m += drift_m;  // NaN stays NaN
  return image;
}

}  // namespace toftwin::sim
