// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

namespace toftwin::reference {
namespace {

struct RollingStart final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "share that the first row loses at 1 ms");
  }
  void onLight(Light& light, const Transport&, const Circumstances& now) const override {
    const auto width = static_cast<std::size_t>(light.width);
    const auto dim = [&](auto& value, std::size_t pixel) {
      const double early = 1.0 - static_cast<double>(pixel / width) / (light.height - 1);
      value *= 1.0 - strength * early * 1e-3 / now.exposure_s;
    };
    for (std::size_t i = 0; i < light.pixels(); ++i) dim(light.steady[i], i);
    for (std::size_t i = 0; i < light.phasors.size(); ++i) dim(light.phasors[i], i % light.pixels());
  }
};

}  // namespace

Row rollingStart() {
  return rowOf<RollingStart>(
      {.name = "rolling_start",
       .summary =
           "rows open one after the other, the first ones before the light is on: they miss a time of it",
       .stage = Stage::Light,
       .unit = "share that the first row loses at 1 ms",
       .covariates = "position, exposure",
       .catalogue = ""});
}

}  // namespace toftwin::reference
