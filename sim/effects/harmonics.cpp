// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/harmonics.h"

#include <algorithm>

namespace toftwin::sim {

int Harmonics::highest() const {
  if (fifth != 0.0) return 5;
  if (fourth != 0.0) return 4;
  if (third != 0.0) return 3;
  return second != 0.0 ? 2 : 1;
}

Light Harmonics::apply(Light light, const Conditions&, const Random&) const {
  if (highest() == 1) return light;
  light.error.content.resize(light.phasors.size());
  const double excess[] = {second, third, fourth, fifth};
  for (std::size_t f = 0; f < light.frequencies.size(); ++f) {
    for (int n = 2; n <= std::min(5, light.harmonics); ++n) {
      light.error.content[f * static_cast<std::size_t>(light.harmonics) +
                          static_cast<std::size_t>(n - 1)] += static_cast<float>(excess[n - 2]);
    }
  }
  return light;
}

}  // namespace toftwin::sim
