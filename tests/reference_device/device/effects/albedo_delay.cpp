// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <algorithm>
#include <cmath>

namespace toftwin::reference {
namespace {

struct AlbedoDelay final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm per e-fold of darkness");
  }
  void onLight(Light& light, const Transport& transport, const Circumstances&) const override {
    delayEach(light, transport, [&](std::size_t i) {
      return light.albedo[i] > 0.0 ? -strength * std::log(std::max(light.albedo[i], 0.02) / 0.8) : 0.0;
    });
  }
};

}  // namespace

Row albedoDelay() {
  return rowOf<AlbedoDelay>({.name = "albedo_delay",
                             .summary = "dark things answer late, whatever their distance",
                             .stage = Stage::Light,
                             .unit = "mm per e-fold of darkness",
                             .covariates = "albedo [amplitude]",
                             .catalogue = ""});
}

}  // namespace toftwin::reference
