// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <cmath>

namespace toftwin::reference {
namespace {

struct ResetGlow final : Hidden {
  double reach = 0.25;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "electrons in the corner");
    v.number("reach", reach, {0.001, 100.0}, "of the width, where it is less by the factor e");
  }
  void onSamples(Charges& charges, const Light& light, const Circumstances&) const override {
    const auto width = static_cast<std::size_t>(light.width), height = static_cast<std::size_t>(light.height);
    for (std::size_t i = 0; i < light.pixels(); ++i) {
      const double away =
          std::hypot(static_cast<double>(width - 1 - i % width), static_cast<double>(height - 1 - i / width));
      const double charge = strength * std::exp(-away / (reach * light.width));
      for (std::size_t f = 0; f < charges.frequencies; ++f) charges.tap(f, 0, 0, i) += charge;
    }
  }
};

}  // namespace

Row resetGlow() {
  return rowOf<ResetGlow>(
      {.name = "reset_glow",
       .summary = "the output amplifier glows at reset: charge in the first raw exposure, most in its corner",
       .stage = Stage::Samples,
       .unit = "electrons in the corner",
       .covariates = "position, amplitude [range, exposure]",
       .catalogue = ""});
}

}  // namespace toftwin::reference
