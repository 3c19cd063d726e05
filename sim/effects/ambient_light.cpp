// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/ambient_light.h"

#include <cmath>
#include <numbers>

namespace toftwin::sim {

Light AmbientLight::apply(Light light, const Conditions& now, const Random&) const {
  if (!now.moment.ambient || light.truth.albedo.empty()) return light;
  const double irradiance = irradiance_per_klx * now.moment.ambient->in(kilolux);
  if (irradiance == 0.0) return light;
  const auto radiance_of_white = static_cast<float>(irradiance / std::numbers::pi);
  for (std::size_t i = 0; i < light.ambient.size(); ++i) {
    const float albedo = light.truth.albedo[i];
    if (!std::isnan(albedo)) light.ambient[i] += albedo * radiance_of_white;
  }
  return light;
}

}  // namespace toftwin::sim
