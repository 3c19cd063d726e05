// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <cmath>

namespace toftwin::reference {
namespace {

struct TableSteps final : Hidden {
  double step_m = 0.32;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm from peak to peak");
    v.number("step_m", step_m, {0.001, 100.0}, "from entry to entry");
  }
  void onRange(Measured& measured, const Light&, const Circumstances&) const override {
    for (float& range : measured.range_m) {
      const double place = static_cast<double>(range) / step_m;
      range += static_cast<float>(1e-3 * strength * (place - std::floor(place) - 0.5));
    }
  }
};

}  // namespace

Row tableSteps() {
  return rowOf<TableSteps>({.name = "table_steps",
                            .summary = "the firmware's table of ranges is coarse: a sawtooth",
                            .stage = Stage::Range,
                            .unit = "mm from peak to peak",
                            .covariates = "range",
                            .catalogue = ""});
}

}  // namespace toftwin::reference
