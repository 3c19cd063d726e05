// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/fixed_pattern_phase.h"

#include <cmath>

#include "sim/images/rows.h"

namespace toftwin::sim {

Light FixedPatternPhase::apply(Light light, const Conditions& now, const Random&) const {
  const auto sigma_rad = static_cast<float>(sigma.in(radian));
  if (sigma_rad == 0.0F) return light;
  // Keyed by the device alone: the pattern must be the same in every frame and for every seed.
  const Random pattern{device, 0, effectKey(about.name, 0)};
  forRows(light.height(), [&](int first_row, int last_row) {
    for (std::size_t f = 0; f < light.frequencies.size(); ++f) {
      const Random::Draw draw = pattern.draw(f);
      for (int y = first_row; y < last_row; ++y) {
        for (int x = 0; x < light.width(); ++x) {
          const std::complex<float> turn =
              std::polar(1.0F, -sigma_rad * draw.normal(now.pixel(x, y)));
          std::complex<float> nth = turn;
          for (int n = 1; n <= light.harmonics; ++n, nth *= turn) light.phasor(f, n)(x, y) *= nth;
        }
      }
    }
  });
  return light;
}

}  // namespace toftwin::sim
