// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

namespace toftwin::reference {
namespace {

struct TemperatureRate final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm per kelvin a minute");
  }
  void onLight(Light& light, const Transport& transport, const Circumstances& now) const override {
    delayEach(light, transport, [&](std::size_t) { return strength * now.sensor_rate_c_per_s * 60.0; });
  }
};

}  // namespace

Row temperatureRate() {
  return rowOf<TemperatureRate>(
      {.name = "temperature_rate",
       .summary = "late by how fast the sensor warms or cools, not by how warm it is",
       .stage = Stage::Light,
       .unit = "mm per kelvin a minute",
       .covariates = "temperature rate [time, temperature]",
       .catalogue = ""});
}

}  // namespace toftwin::reference
