// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <algorithm>
#include <type_traits>
#include <vector>

namespace toftwin::reference {
namespace {

struct OverexposedScatter final : Hidden {
  double threshold_electrons = 12000.0;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "share of the excess");
    v.number("threshold_electrons", threshold_electrons, {1.0, 1e9}, "in both taps");
  }
  void onLight(Light& light, const Transport& transport, const Circumstances& now) const override {
    const double gain = transport.sheet().pixel.electrons_per_radiance_s * now.exposure_s,
                 count = static_cast<double>(light.pixels());
    const std::vector<double> steady = light.steady;
    const auto excess = [&](std::size_t i) {
      return std::max(0.0, 1.0 - threshold_electrons / std::max(gain * steady[i], 1e-9));
    };
    const auto spill = [&](auto* values) {
      std::remove_reference_t<decltype(*values)> sum{};
      for (std::size_t i = 0; i < light.pixels(); ++i) sum += excess(i) * values[i];
      for (std::size_t i = 0; i < light.pixels(); ++i) values[i] += strength * sum / count;
    };
    spill(light.steady.data());
    for (std::size_t plane = 0; plane < light.phasors.size(); plane += light.pixels())
      spill(light.phasors.data() + plane);
  }
};

}  // namespace

Row overexposedScatter() {
  return rowOf<OverexposedScatter>(
      {.name = "overexposed_scatter",
       .summary = "what is beyond a brightness spills over the whole chip, with its phase",
       .stage = Stage::Light,
       .unit = "share of the excess",
       .covariates = "neighbours, exposure [amplitude, range]",
       .catalogue = ""});
}

}  // namespace toftwin::reference
