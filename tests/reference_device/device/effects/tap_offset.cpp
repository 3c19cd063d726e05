// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

namespace toftwin::reference {
namespace {

struct TapOffset final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "electrons");
  }
  void onSamples(Charges& charges, const Light& light, const Circumstances&) const override {
    for (std::size_t f = 0; f < charges.frequencies; ++f) {
      for (std::size_t i = 0; i < light.pixels(); ++i) charges.tap(f, 0, 0, i) += strength;
    }
  }
};

}  // namespace

Row tapOffset() {
  return rowOf<TapOffset>(
      {.name = "tap_offset",
       .summary = "a charge that does not come from light stays in the first raw exposure's first tap",
       .stage = Stage::Samples,
       .unit = "electrons",
       .covariates = "amplitude [range, exposure]",
       .catalogue = "sample_offset"});
}

}  // namespace toftwin::reference
