// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <cmath>

namespace toftwin::reference {
namespace {

struct SpreadSpectrum final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "share of the modulation lost at 1 m");
  }
  /// Phase is in proportion to the way and to the frequency: what is spread there is washed out by the
  /// square of both.
  void onLight(Light& light, const Transport&, const Circumstances&) const override {
    for (std::size_t f = 0; f < light.frequencies; ++f) {
      for (std::size_t n = 1; n <= light.harmonics; ++n) {
        for (std::size_t i = 0; i < light.pixels(); ++i) {
          if (std::isnan(light.range_m[i])) continue;
          light.phasor(f, n, i) *=
              std::exp(-strength * std::pow(static_cast<double>(n) * light.range_m[i], 2));
        }
      }
    }
  }
};

}  // namespace

Row spreadSpectrum() {
  return rowOf<SpreadSpectrum>(
      {.name = "spread_spectrum",
       .summary = "the clock is spread, to disturb no radio: far light loses its modulation, harmonics first",
       .stage = Stage::Light,
       .unit = "share of the modulation lost at 1 m",
       .covariates = "range [amplitude]",
       .catalogue = ""});
}

}  // namespace toftwin::reference
