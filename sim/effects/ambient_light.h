// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Sun or lamps on everything the camera sees, as the moment's ambient illuminance says: a surface
/// of albedo ρ adds the unmodulated radiance
///     L = ρ E / π,   E = irradiance within the camera's filter per kilolux × illuminance
/// evenly, without shadows (a scene's own lamps are traced and lie in the light already). Pixels
/// that see no surface get none.
struct AmbientLight {
  /// Sunlight: 0.9 W/(m² nm) at 850 nm (ASTM G173-03, AM1.5 global) over a 30 nm filter per 100
  /// klx.
  double irradiance_per_klx = 0.27;  ///< W/m² per klx

  static constexpr About about{
      .name = "ambient_light",
      .summary = "even sun or lamp light from the moment's illuminance, unmodulated",
      .reference = "ASTM G173-03 (solar spectrum)",
      .explains = {Covariate::Ambient, Covariate::Amplitude}};
  static AmbientLight none() { return {.irradiance_per_klx = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number(
        "irradiance_w_per_m2_per_klx", irradiance_per_klx, {0.0, 100.0},
        "in the camera's band, per kilolux: 0.27 for the sun through a 30 nm filter at 850 nm");
  }
  /// Whether it adds anything.
  [[nodiscard]] bool shines(const Light& light, const Conditions& now) const;
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
