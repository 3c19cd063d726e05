// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/range_noise.h"

namespace toftwin::sim {

RangeImage RangeNoise::apply(RangeImage image, const Conditions& now, const Random& random) const {
  const auto sigma_m = static_cast<float>(sigma.in(metre));
  if (sigma_m == 0.0F) return image;
  const Random::Draw draw = random.draw(0);
  for (int y = 0; y < image.range_m.height(); ++y) {
    float* range_m = &image.range_m(0, y);
    const std::uint32_t first = now.pixel(0, y);
    for (int x = 0; x < image.range_m.width(); ++x) {
      range_m[x] += sigma_m * draw.normal(first + static_cast<std::uint32_t>(x));  // NaN stays NaN
    }
  }
  return image;
}

}  // namespace toftwin::sim
