// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/propagation_delay.h"

#include <cmath>
#include <vector>

#include "sim/effects/phasors.h"

namespace toftwin::sim {

Light PropagationDelay::apply(Light light, const Conditions& now, const Random&) const {
  if (per_column == 0_mm && per_row == 0_mm && per_row_from_middle == 0_mm) return light;
  const double middle_x = 0.5 * (now.camera.width - 1), middle_y = 0.5 * (now.camera.height - 1);
  for (std::size_t f = 0; f < light.frequencies.size(); ++f) {
    for (int n = 1; n <= light.harmonics; ++n) {
      auto& phasors = light.phasor(f, n);
      if (phasors.empty()) continue;
      const auto turnOf = [&](Length delay) {
        return std::complex<float>{std::polar(1.0, -n * phaseOfRange(delay, light.frequencies[f]))};
      };
      // The delay is a sum over columns and rows, so its turn is a product.
      std::vector<std::complex<float>> of_column;
      for (int x = 0; x < light.width(); ++x)
        of_column.push_back(turnOf(per_column * (now.left + x - middle_x)));
      forRows(light.height(), [&](int first_row, int last_row) {
        for (int y = first_row; y < last_row; ++y) {
          const double below = now.top + y - middle_y;
          const std::complex<float> of_row =
              turnOf(per_row * below + per_row_from_middle * std::abs(below));
          for (int x = 0; x < light.width(); ++x)
            phasors(x, y) *= of_column[static_cast<std::size_t>(x)] * of_row;
        }
      });
    }
  }
  return light;
}

}  // namespace toftwin::sim
