// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/duty_drift.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/effects/phasors.h"
#include "sim/effects/temperature.h"

namespace toftwin::sim {

Light DutyDrift::apply(Light light, const Conditions& now, const Random&) const {
  constexpr double kPi = std::numbers::pi;
  const double degrees = degreesAbove(reference, now.moment, "illumination");
  const double drifted = std::clamp(duty + per_degree * degrees, 0.01, 0.99);
  if (drifted == duty) return light;
  const double late = (falling_edge - 0.5) * (drifted - duty);
  multiplyPhasors(light, [&](std::size_t, int n) {
    const double nominal = std::sin(n * kPi * duty);
    const double growth = std::abs(nominal) < 1e-9 ? 1.0 : std::sin(n * kPi * drifted) / nominal;
    return std::polar(1.0, -2.0 * kPi * n * late) * growth;
  });
  const auto brighter = static_cast<float>(drifted / duty);
  for (float& radiance : light.steady.pixels()) radiance *= brighter;
  return light;
}

}  // namespace toftwin::sim
