// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

namespace toftwin::reference {
namespace {

struct ThermalLens final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm at the corner, 10 K above the room");
  }
  void onLight(Light& light, const Transport& transport, const Circumstances& now) const override {
    const double warm = (now.sensor_c - 23.0) / 10.0;
    delayEach(light, transport, [&](std::size_t i) { return strength * warm * squareOfRadius(light, i); });
  }
};

}  // namespace

Row thermalLens() {
  return rowOf<ThermalLens>(
      {.name = "thermal_lens",
       .summary = "a warm lens delays the image's edges: by temperature and square of the radius",
       .stage = Stage::Light,
       .unit = "mm at the corner, 10 K above the room",
       .covariates = "temperature, position [time]",
       .catalogue = ""});
}

}  // namespace toftwin::reference
