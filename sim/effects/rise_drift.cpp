// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/rise_drift.h"

#include <algorithm>
#include <numbers>

#include "sim/effects/phasors.h"
#include "sim/effects/temperature.h"

namespace toftwin::sim {

Light RiseDrift::apply(Light light, const Conditions& now, const Random&) const {
  const double degrees = degreesAbove(reference, now.moment, "illumination");
  const Duration drifted = std::max(0_s, rise + per_degree * degrees);
  if (drifted == rise) return light;
  multiplyPhasors(light, [&](std::size_t f, int n) {
    const double n_omega = 2.0 * std::numbers::pi * n * light.frequencies[f].in(hertz);
    return std::complex<double>{1.0, n_omega * rise.in(second)} /
           std::complex<double>{1.0, n_omega * drifted.in(second)};
  });
  return light;
}

}  // namespace toftwin::sim
