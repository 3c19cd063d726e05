// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/shot_noise.h"

#include <vector>

#include "sim/images/rows.h"

namespace toftwin::sim {

Samples ShotNoise::apply(Samples samples, const Conditions& now, const Random& random) const {
  if (fano <= 0.0) return samples;
  const auto width = static_cast<std::size_t>(samples.width());
  const auto scale = static_cast<float>(fano);
  forRows(samples.height(), [&](int first_row, int last_row) {
    std::vector<float> charge(width);
    for (std::size_t image = 0; image < samples.electrons.size(); ++image) {
      const Random::Draw draw = random.draw(image);
      for (int y = first_row; y < last_row; ++y) {
        float* electrons = &samples.electrons[image](0, y);
        // A count of variance fano·S: fano times a Poisson count of mean S / fano.
        for (std::size_t x = 0; x < width; ++x) charge[x] = electrons[x] / scale;
        poisson(draw, now.pixel(0, y), charge);
        for (std::size_t x = 0; x < width; ++x) electrons[x] = charge[x] * scale;
      }
    }
  });
  return samples;
}

}  // namespace toftwin::sim
