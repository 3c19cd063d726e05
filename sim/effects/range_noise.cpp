// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/range_noise.h"

#include <vector>

#include "sim/images/rows.h"

namespace toftwin::sim {

RangeImage RangeNoise::apply(RangeImage image, const Conditions& now, const Random& random) const {
  const auto sigma_m = static_cast<float>(sigma.in(metre));
  if (sigma_m == 0.0F) return image;
  const Random::Draw draw = random.draw(0);
  forRows(image.range_m.height(), [&](int first_row, int last_row) {
    std::vector<float> normals(static_cast<std::size_t>(image.range_m.width()));
    for (int y = first_row; y < last_row; ++y) {
      float* range_m = &image.range_m(0, y);
      fillNormals(draw, now.pixel(0, y), normals);
      for (std::size_t x = 0; x < normals.size(); ++x)
        range_m[x] += sigma_m * normals[x];  // NaN stays NaN
    }
  });
  return image;
}

}  // namespace toftwin::sim
