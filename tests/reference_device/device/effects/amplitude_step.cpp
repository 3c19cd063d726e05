// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <algorithm>
#include <cmath>

namespace toftwin::reference {
namespace {

struct AmplitudeStep final : Hidden {
  double at_electrons = 8000.0;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm");
    v.number("at_electrons", at_electrons, {1.0, 1e9}, "in both taps");
  }
  void onLight(Light& light, const Transport& transport, const Circumstances& now) const override {
    const double gain = transport.sheet().pixel.electrons_per_radiance_s * now.exposure_s;
    delayEach(light, transport, [&](std::size_t i) {
      return strength /
             (1.0 + std::exp(-8.0 * std::log(std::max(gain * light.steady[i], 1e-9) / at_electrons)));
    });
  }
};

}  // namespace

Row amplitudeStep() {
  return rowOf<AmplitudeStep>({.name = "amplitude_step",
                               .summary = "an amplifier that switches its gain is late above a brightness",
                               .stage = Stage::Light,
                               .unit = "mm",
                               .covariates = "amplitude",
                               .catalogue = ""});
}

}  // namespace toftwin::reference
