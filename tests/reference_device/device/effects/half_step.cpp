// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

namespace toftwin::reference {
namespace {

struct HalfStep final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm from half to half");
  }
  void onLight(Light& light, const Transport& transport, const Circumstances&) const override {
    delayEach(light, transport,
              [&](std::size_t i) { return i < light.pixels() / 2 ? -0.5 * strength : 0.5 * strength; });
  }
};

}  // namespace

Row halfStep() {
  return rowOf<HalfStep>({.name = "half_step",
                          .summary = "the sensor is read in two halves, and the lower one is late",
                          .stage = Stage::Light,
                          .unit = "mm from half to half",
                          .covariates = "position",
                          .catalogue = ""});
}

}  // namespace toftwin::reference
