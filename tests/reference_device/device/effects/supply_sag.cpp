// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

namespace toftwin::reference {
namespace {

struct SupplySag final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "share from the first to the last, at 1 ms");
  }
  void onSamples(Charges& charges, const Light& light, const Circumstances& now) const override {
    for (std::size_t f = 0; f < charges.frequencies; ++f) {
      for (std::size_t k = 0; k < charges.steps; ++k) {
        const double place = static_cast<double>(k) / static_cast<double>(charges.steps - 1) - 0.5;
        const double factor = 1.0 - strength * place * now.exposure_s / 1e-3;
        for (std::size_t i = 0; i < light.pixels(); ++i)
          charges.tap(f, k, 0, i) *= factor, charges.tap(f, k, 1, i) *= factor;
      }
    }
  }
};

}  // namespace

Row supplySag() {
  return rowOf<SupplySag>(
      {.name = "supply_sag",
       .summary = "the light weakens from raw exposure to raw exposure, the more the longer they are",
       .stage = Stage::Samples,
       .unit = "share from the first to the last, at 1 ms",
       .covariates = "exposure [amplitude, range]",
       .catalogue = ""});
}

}  // namespace toftwin::reference
