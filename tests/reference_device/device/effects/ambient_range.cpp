// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <cmath>

namespace toftwin::reference {
namespace {

struct AmbientRange final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm per klx and metre");
  }
  void onLight(Light& light, const Transport& transport, const Circumstances& now) const override {
    delayEach(light, transport, [&](std::size_t i) {
      return std::isnan(light.range_m[i]) ? 0.0 : strength * now.ambient_klx * light.range_m[i];
    });
  }
};

}  // namespace

Row ambientRange() {
  return rowOf<AmbientRange>({.name = "ambient_range",
                              .summary = "ambient light makes far things farther",
                              .stage = Stage::Light,
                              .unit = "mm per klx and metre",
                              .covariates = "ambient, range",
                              .catalogue = ""});
}

}  // namespace toftwin::reference
