// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <cmath>
#include <numeric>
#include <type_traits>

namespace toftwin::reference {
namespace {

struct Dust final : Hidden {
  double x = 0.3;
  double y = 0.6;
  double radius = 0.1;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "share at its middle");
    v.number("x", x, {0.0, 1.0}, "of the width");
    v.number("y", y, {0.0, 1.0}, "of the height");
    v.number("radius", radius, {0.001, 1.0}, "of the width");
  }
  void onLight(Light& light, const Transport&, const Circumstances&) const override {
    const auto width = static_cast<std::size_t>(light.width);
    const double count = static_cast<double>(light.pixels());
    const auto spoil = [&](auto* values) {
      const auto mean =
          std::accumulate(values, values + light.pixels(), std::remove_reference_t<decltype(*values)>{}) /
          count;
      for (std::size_t i = 0; i < light.pixels(); ++i) {
        const double dx = static_cast<double>(i % width) / light.width - x,
                     dy = static_cast<double>(i / width) / light.height - y;
        const double share = strength * std::exp(-0.5 * (dx * dx + dy * dy) / (radius * radius));
        values[i] += share * (mean - values[i]);
      }
    };
    spoil(light.steady.data());
    for (std::size_t plane = 0; plane < light.phasors.size(); plane += light.pixels())
      spoil(light.phasors.data() + plane);
  }
};

}  // namespace

Row dust() {
  return rowOf<Dust>(
      {.name = "dust",
       .summary = "a speck on the lens: its pixels lose light, and get the image's mean instead",
       .stage = Stage::Light,
       .unit = "share at its middle",
       .covariates = "position, neighbours",
       .catalogue = ""});
}

}  // namespace toftwin::reference
