// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/sample_gain.h"

namespace toftwin::sim {

Samples SampleGain::apply(Samples samples, const Conditions&, const Random&) const {
  if (gain == 0.0 || step >= samples.steps || tap >= samples.taps) return samples;
  const auto factor = static_cast<float>(1.0 + gain);
  const auto groups = samples.electrons.size() / static_cast<std::size_t>(samples.steps * samples.taps);
  for (std::size_t f = 0; f < groups; ++f) {  // frequencies; a pulsed camera's gates are one group
    for (float& charge : samples.tap(f, step, tap).pixels()) charge *= factor;
  }
  return samples;
}

}  // namespace toftwin::sim
