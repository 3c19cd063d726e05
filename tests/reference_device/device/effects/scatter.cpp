// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

namespace toftwin::reference {
namespace {

struct Scatter final : Hidden {
  double halo_radius_px = 0.0;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "share");
    v.number("halo_radius_px", halo_radius_px, {0.0, 500.0}, "standard deviation; 0: all over the image");
  }
  void onLight(Light& light, const Transport&, const Circumstances&) const override {
    spread(light, light.steady.data());
    for (std::size_t plane = 0; plane < light.phasors.size(); plane += light.pixels())
      spread(light, light.phasors.data() + plane);
  }
  /// By direct summation along rows, then columns: light that falls beside the image is lost.
  template <class Value>
  void spread(const Light& light, Value* values) const {
    const auto width = static_cast<std::size_t>(light.width);
    std::vector<Value> spread_out(light.pixels());
    if (halo_radius_px == 0.0) {
      const Value mean =
          std::accumulate(values, values + light.pixels(), Value{}) / static_cast<double>(light.pixels());
      std::ranges::fill(spread_out, mean);
    } else {
      std::vector<double> kernel;
      for (int d = 0; d < std::max(light.width, light.height); ++d) {
        kernel.push_back(std::exp(-0.5 * std::pow(d / halo_radius_px, 2)) /
                         (std::sqrt(2.0 * std::numbers::pi) * halo_radius_px));
      }
      std::vector<Value> rows(light.pixels());
      const auto apart = [](std::size_t a, std::size_t b) { return a > b ? a - b : b - a; };
      for (std::size_t i = 0; i < light.pixels(); ++i) {
        for (std::size_t x = 0; x < width; ++x)
          rows[i] += kernel[apart(x, i % width)] * values[i - i % width + x];
      }
      for (std::size_t i = 0; i < light.pixels(); ++i) {
        for (std::size_t y = i % width; y < light.pixels(); y += width)
          spread_out[i] += kernel[apart(y / width, i / width)] * rows[y];
      }
    }
    for (std::size_t i = 0; i < light.pixels(); ++i)
      values[i] = (1.0 - strength) * values[i] + strength * spread_out[i];
  }
};

}  // namespace

Row scatter() {
  return rowOf<Scatter>(
      {.name = "scatter",
       .summary = "the lens spreads a share of the light: over the whole image, or in a Gaussian halo",
       .stage = Stage::Light,
       .unit = "share",
       .covariates = "neighbours [amplitude, range]",
       .catalogue = "lens_scatter"});
}

}  // namespace toftwin::reference
