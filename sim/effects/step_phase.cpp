// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/step_phase.h"

#include <algorithm>

namespace toftwin::sim {

Light StepPhase::apply(Light light, const Conditions&, const Random&) const {
  if (error == 0_rad) return light;
  const auto k = static_cast<std::size_t>(step);
  light.error.step_rad.resize(std::max(light.error.step_rad.size(), k + 1));
  light.error.step_rad[k] += static_cast<float>(error.in(radian));
  return light;
}

}  // namespace toftwin::sim
