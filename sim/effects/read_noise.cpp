// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/read_noise.h"

#include <vector>

#include "sim/images/rows.h"

namespace toftwin::sim {

Samples ReadNoise::apply(Samples samples, const Conditions& now, const Random& random) const {
  if (sigma_electrons <= 0.0) return samples;
  const auto sigma = static_cast<float>(sigma_electrons);
  const auto width = static_cast<std::size_t>(samples.width());
  forRows(samples.height(), [&](int first_row, int last_row) {
    std::vector<float> normals(width);
    for (std::size_t image = 0; image < samples.electrons.size(); ++image) {
      const Random::Draw draw = random.draw(image);
      for (int y = first_row; y < last_row; ++y) {
        float* electrons = &samples.electrons[image](0, y);
        fillNormals(draw, now.pixel(0, y), normals);
        for (std::size_t x = 0; x < width; ++x) electrons[x] += sigma * normals[x];
      }
    }
  });
  return samples;
}

}  // namespace toftwin::sim
