// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/nonlinearity.h"

#include "sim/images/rows.h"

namespace toftwin::sim {

Samples Nonlinearity::apply(Samples samples, const Conditions&, const Random&) const {
  if (quadratic == 0.0 && cubic == 0.0) return samples;
  const auto q = static_cast<float>(quadratic), kappa = static_cast<float>(cubic);
  forRows(samples.height(), [&](int first_row, int last_row) {
    for (Image<float>& image : samples.electrons) {
      for (int y = first_row; y < last_row; ++y) {
        float* electrons = &image(0, y);
        for (int x = 0; x < image.width(); ++x) {
          const float s = electrons[x];
          electrons[x] = s - (q + kappa * s) * s * s;
        }
      }
    }
  });
  return samples;
}

}  // namespace toftwin::sim
