// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <cmath>
#include <cstdint>
#include <numbers>

namespace toftwin::reference {
namespace {

struct InterferenceBurst final : Hidden {
  int period = 7;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "electrons");
    v.number("period", period, {1, 1000}, "frames");
  }
  void onSamples(Charges& charges, const Light& light, const Circumstances& now) const override {
    if (now.frame % static_cast<std::uint64_t>(period) != 3 % static_cast<std::uint64_t>(period)) return;
    for (std::size_t f = 0; f < charges.frequencies; ++f) {
      for (std::size_t k = 0; k < charges.steps; ++k) {
        const double beat = strength * std::cos(2.0 * std::numbers::pi * 0.31 * static_cast<double>(k) + 0.4);
        for (std::size_t i = 0; i < light.pixels(); ++i) {
          charges.tap(f, k, 0, i) += 0.5 * (std::abs(strength) + beat);
          charges.tap(f, k, 1, i) += 0.5 * (std::abs(strength) - beat);
        }
      }
    }
  }
};

}  // namespace

Row interferenceBurst() {
  return rowOf<InterferenceBurst>(
      {.name = "interference_burst",
       .summary = "another device shines into every seventh frame, beating from exposure to exposure",
       .stage = Stage::Samples,
       .unit = "electrons",
       .covariates = "frame",
       .catalogue = ""});
}

}  // namespace toftwin::reference
