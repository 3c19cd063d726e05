// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/sample_gain.h"

namespace toftwin::sim {

Samples SampleGain::apply(Samples samples, const Conditions&, const Random&) const {
  if (gain == 0.0 || step >= samples.steps || tap >= samples.taps) return samples;
  const auto factor = static_cast<float>(1.0 + gain);
  for (std::size_t f = 0; f < samples.frequencies.size(); ++f) {
    for (float& charge : samples.tap(f, step, tap).pixels()) charge *= factor;
  }
  return samples;
}

}  // namespace toftwin::sim
