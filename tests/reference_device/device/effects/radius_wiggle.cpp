// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <cmath>

namespace toftwin::reference {
namespace {

struct RadiusWiggle final : Hidden {
  int cycles = 3;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm at the corner");
    v.number("cycles", cycles, {1, 32}, "per turn of phase");
  }
  void onLight(Light& light, const Transport& transport, const Circumstances&) const override {
    const double per_metre = 2.0 * transport.wavenumber(0) * cycles;
    delayEach(light, transport, [&](std::size_t i) {
      return std::isnan(light.range_m[i])
                 ? 0.0
                 : strength * squareOfRadius(light, i) * std::sin(per_metre * light.range_m[i]);
    });
  }
};

}  // namespace

Row radiusWiggle() {
  return rowOf<RadiusWiggle>({.name = "radius_wiggle",
                              .summary = "a cyclic error that grows towards the image's edge",
                              .stage = Stage::Light,
                              .unit = "mm at the corner",
                              .covariates = "range, position",
                              .catalogue = ""});
}

}  // namespace toftwin::reference
