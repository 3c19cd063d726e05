// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/quantisation.h"

#include <cmath>

#include "sim/images/rows.h"

namespace toftwin::sim {

Samples Quantisation::apply(Samples samples, const Conditions&, const Random&) const {
  if (step_electrons <= 0.0) return samples;
  const auto step = static_cast<float>(step_electrons);
  const int width = samples.width();
  forRows(samples.height(), [&](int first_row, int last_row) {
    for (Image<float>& image : samples.electrons) {
      for (int y = first_row; y < last_row; ++y) {
        float* electrons = &image(0, y);
        for (int x = 0; x < width; ++x) electrons[x] = step * std::nearbyint(electrons[x] / step);
      }
    }
  });
  return samples;
}

}  // namespace toftwin::sim
