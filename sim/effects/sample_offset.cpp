// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/sample_offset.h"

namespace toftwin::sim {

Samples SampleOffset::apply(Samples samples, const Conditions&, const Random&) const {
  if (electrons == 0.0 || step >= samples.steps || tap >= samples.taps) return samples;
  const auto groups = samples.electrons.size() / static_cast<std::size_t>(samples.steps * samples.taps);
  for (std::size_t f = 0; f < groups; ++f) {  // frequencies; a pulsed camera's gates are one group
    for (float& charge : samples.tap(f, step, tap).pixels()) charge += static_cast<float>(electrons);
  }
  return samples;
}

}  // namespace toftwin::sim
