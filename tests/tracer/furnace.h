// SPDX-License-Identifier: Apache-2.0
// The integrating sphere of radius R = 1 m with camera and light of 1 W/sr in its centre: all bounces have a
// closed form.
#pragma once

#include "tests/tracer/tracing.h"

namespace toftwin::sim::testing {

struct Furnace {
  double albedo = 0.5;  ///< ρ
  int surfaces = 60;    ///< N

  [[nodiscard]] Scene scene() const {
    return sceneOf("[[material]]\nname = 'm'\nalbedo = " + std::to_string(albedo) +
                   "\n[[object]]\nshape = 'sphere'\nradius_m = 1\nmaterial = 'm'\n");
  }
  /// P = ρI/(πR²) · e^{−2ikR} · (1 − (ρΦ)^N) / (1 − ρΦ),  Φ = [(1 + 2ikR) e^{−2ikR} − 1] / (2k²R²)
  [[nodiscard]] Complex phasor(Frequency f) const {
    const double k = wavenumber(f);
    const Complex i{0.0, 1.0}, turn = std::polar(1.0, -2.0 * k);
    const Complex phi = ((1.0 + 2.0 * i * k) * turn - 1.0) / (2.0 * k * k);
    return albedo / kPi * turn * (1.0 - std::pow(albedo * phi, surfaces)) / (1.0 - albedo * phi);
  }
};

}  // namespace toftwin::sim::testing
