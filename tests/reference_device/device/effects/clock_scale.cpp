// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

namespace toftwin::reference {
namespace {

struct ClockScale final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm per metre");
  }
  void onRange(Measured& measured, const Light&, const Circumstances&) const override {
    for (float& range : measured.range_m) range *= static_cast<float>(1.0 + 1e-3 * strength);
  }
};

}  // namespace

Row clockScale() {
  return rowOf<ClockScale>({.name = "clock_scale",
                            .summary = "the clock is wrong: all ranges by the same share",
                            .stage = Stage::Range,
                            .unit = "mm per metre",
                            .covariates = "range",
                            .catalogue = "clock_scale"});
}

}  // namespace toftwin::reference
