// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/internal_reflection.h"

#include "sim/effects/phasors.h"

namespace toftwin::sim {

Light InternalReflection::apply(Light light, const Conditions&, const Random&) const {
  if (radiance == 0.0) return light;
  for (std::size_t f = 0; f < light.frequencies.size(); ++f) {
    for (int n = 1; n <= light.harmonics; ++n) {
      const std::complex<float> stray{
          std::polar(radiance, -n * phaseOfRange(half_way, light.frequencies[f]))};
      for (auto& phasor : light.phasor(f, n).pixels()) phasor += stray;
    }
  }
  for (float& steady : light.steady.pixels()) steady += static_cast<float>(radiance);
  return light;
}

}  // namespace toftwin::sim
