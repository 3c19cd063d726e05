// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <cmath>

namespace toftwin::reference {
namespace {

struct ExposureWindow final : Hidden {
  double at_us = 620.0;
  double width = 0.04;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm");
    v.number("at_us", at_us, {1.0, 20000.0}, "of a raw exposure");
    v.number("width", width, {0.001, 10.0}, "of the logarithm");
  }
  void onLight(Light& light, const Transport& transport, const Circumstances& now) const override {
    const double off = std::log(now.exposure_s * 1e6 / at_us) / width;
    const double late = strength * std::exp(-0.5 * off * off);
    delayEach(light, transport, [&](std::size_t) { return late; });
  }
};

}  // namespace

Row exposureWindow() {
  return rowOf<ExposureWindow>(
      {.name = "exposure_window",
       .summary = "late at one exposure time only, as by a resonance: at that of the locked captures",
       .stage = Stage::Light,
       .unit = "mm",
       .covariates = "exposure",
       .catalogue = ""});
}

}  // namespace toftwin::reference
