// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

namespace toftwin::reference {
namespace {

struct ModeHop final : Hidden {
  double at_c = 43.0;
  double gain_per_mm = 0.002;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm from mode to mode");
    v.number("at_c", at_c, {-100.0, 200.0}, "of the illumination");
    v.number("gain_per_mm", gain_per_mm, {-1.0, 1.0}, "by which the late mode is weaker");
  }
  void onLight(Light& light, const Transport& transport, const Circumstances& now) const override {
    const double late = now.illumination_c > at_c ? 0.5 * strength : -0.5 * strength;
    delayEach(light, transport, [&](std::size_t) { return late; });
    for (auto& p : light.phasors) p *= 1.0 - gain_per_mm * late;
    for (double& s : light.steady) s *= 1.0 - gain_per_mm * late;
  }
};

}  // namespace

Row modeHop() {
  return rowOf<ModeHop>({.name = "mode_hop",
                         .summary = "the laser jumps to another mode when it is warm: later and weaker",
                         .stage = Stage::Light,
                         .unit = "mm from mode to mode",
                         .covariates = "temperature [time]",
                         .catalogue = ""});
}

}  // namespace toftwin::reference
