// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/low_amplitude_filter.h"

#include "sim/effects/neighbours.h"

namespace toftwin::sim {

RangeImage LowAmplitudeFilter::apply(RangeImage image, const Conditions&, const Random&) const {
  const auto minimum = static_cast<float>(minimum_electrons);
  if (minimum == 0.0F) return image;
  rejectWhere(image, PixelFlag::LowAmplitude,
              [&](int x, int y) { return !(image.amplitude(x, y) >= minimum); });
  return image;
}

}  // namespace toftwin::sim
