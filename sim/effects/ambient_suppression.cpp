// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/ambient_suppression.h"

#include <algorithm>

#include "sim/images/rows.h"

namespace toftwin::sim {

Samples AmbientSuppression::apply(Samples samples, const Conditions&, const Random&) const {
  if (share == 0.0 || samples.taps != 2) return samples;
  const auto of_common = static_cast<float>(share), limit = static_cast<float>(limit_electrons),
             loss = static_cast<float>(contrast_loss);
  forRows(samples.height(), [&](int first_row, int last_row) {
    for (std::size_t i = 0; i + 1 < samples.electrons.size(); i += 2) {
      for (int y = first_row; y < last_row; ++y) {
        float* a = &samples.electrons[i](0, y);
        float* b = &samples.electrons[i + 1](0, y);
        for (int x = 0; x < samples.width(); ++x) {
          const float common = std::max(0.0F, std::min(a[x], b[x]));
          const float removed = std::min(of_common * common, limit);
          const float kept = std::max(0.0F, 1.0F - loss * removed);
          const float mean = 0.5F * (a[x] + b[x]) - removed;
          const float half = 0.5F * (a[x] - b[x]) * kept;
          a[x] = mean + half;
          b[x] = mean - half;
        }
      }
    }
  });
  return samples;
}

}  // namespace toftwin::sim
