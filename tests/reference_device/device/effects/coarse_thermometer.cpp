// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <cmath>

namespace toftwin::reference {
namespace {

struct CoarseThermometer final : Hidden {
  double step_c = 4.0;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm per kelvin within a step");
    v.number("step_c", step_c, {0.01, 100.0}, "of the firmware's thermometer");
  }
  void onRange(Measured& measured, const Light&, const Circumstances& now) const override {
    const double unseen_c = now.sensor_c - step_c * std::round(now.sensor_c / step_c);
    for (float& range : measured.range_m) range += static_cast<float>(1e-3 * strength * unseen_c);
  }
};

}  // namespace

Row coarseThermometer() {
  return rowOf<CoarseThermometer>(
      {.name = "coarse_thermometer",
       .summary = "the firmware corrects for the sensor's temperature in steps: a sawtooth is left",
       .stage = Stage::Range,
       .unit = "mm per kelvin within a step",
       .covariates = "temperature",
       .catalogue = ""});
}

}  // namespace toftwin::reference
