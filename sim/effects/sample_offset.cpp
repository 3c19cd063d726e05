// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/sample_offset.h"

namespace toftwin::sim {

Samples SampleOffset::apply(Samples samples, const Conditions&, const Random&) const {
  if (electrons == 0.0 || step >= samples.steps || tap >= samples.taps) return samples;
  for (std::size_t f = 0; f < samples.frequencies.size(); ++f) {
    for (float& charge : samples.tap(f, step, tap).pixels()) charge += static_cast<float>(electrons);
  }
  return samples;
}

}  // namespace toftwin::sim
