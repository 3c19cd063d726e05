// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <cmath>

namespace toftwin::reference {
namespace {

struct ExposureDelay final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm per e-fold of exposure");
  }
  void onLight(Light& light, const Transport& transport, const Circumstances& now) const override {
    const double late = strength * std::log(now.exposure_s / 1e-3);
    delayEach(light, transport, [&](std::size_t) { return late; });
  }
};

}  // namespace

Row exposureDelay() {
  return rowOf<ExposureDelay>({.name = "exposure_delay",
                               .summary = "the driver of the light is late by the logarithm of the exposure",
                               .stage = Stage::Light,
                               .unit = "mm per e-fold of exposure",
                               .covariates = "exposure",
                               .catalogue = ""});
}

}  // namespace toftwin::reference
