// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/ambient_light.h"

#include <cmath>
#include <numbers>

namespace toftwin::sim {

bool AmbientLight::shines(const Light& light, const Conditions& now) const {
  return now.moment.ambient && !light.truth.albedo.empty() &&
         irradiance_per_klx * now.moment.ambient->in(kilolux) != 0.0;
}

Light AmbientLight::apply(Light light, const Conditions& now, const Random&) const {
  if (!shines(light, now)) return light;
  const double irradiance = irradiance_per_klx * now.moment.ambient->in(kilolux);
  const auto radiance_of_white = static_cast<float>(irradiance / std::numbers::pi);
  for (std::size_t i = 0; i < light.ambient.size(); ++i) {
    const float albedo = light.truth.albedo[i];
    if (!std::isnan(albedo)) light.ambient[i] += albedo * radiance_of_white;
  }
  return light;
}

}  // namespace toftwin::sim
