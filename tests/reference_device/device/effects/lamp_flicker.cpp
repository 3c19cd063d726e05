// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <cmath>
#include <numbers>

namespace toftwin::reference {
namespace {

struct LampFlicker final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "share of the ambient charge");
  }
  void onSamples(Charges& charges, const Light& light, const Circumstances& now) const override {
    const double per_klx = strength * 40.0 * now.ambient_klx * now.exposure_s / 1e-3;
    for (std::size_t f = 0; f < charges.frequencies; ++f) {
      for (std::size_t k = 0; k < charges.steps; ++k) {
        const double time_s = now.since_power_on_s + 1.5e-3 * static_cast<double>(f * charges.steps + k);
        const double extra =
            per_klx * (1.0 + std::sin(2.0 * std::numbers::pi * 100.0 * std::fmod(time_s, 1.0)));
        for (std::size_t i = 0; i < light.pixels(); ++i) charges.tap(f, k, 0, i) += extra * light.albedo[i];
      }
    }
  }
};

}  // namespace

Row lampFlicker() {
  return rowOf<LampFlicker>(
      {.name = "lamp_flicker",
       .summary = "ambient light flickers at 100 Hz, and the taps do not share it evenly",
       .stage = Stage::Samples,
       .unit = "share of the ambient charge",
       .covariates = "ambient, frame [amplitude]",
       .catalogue = ""});
}

}  // namespace toftwin::reference
