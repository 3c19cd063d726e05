// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <algorithm>
#include <cmath>

namespace toftwin::reference {
namespace {

struct GlossyPaint final : Hidden {
  double exponent = 20.0;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "share more, seen straight on");
    v.number("exponent", exponent, {0.1, 1e4}, "of the cosine to the mirror's direction");
  }
  /// The lamp is beside the lens, so the mirror's direction is as far from the eye as twice the incidence.
  void onLight(Light& light, const Transport&, const Circumstances&) const override {
    std::vector<double> factor(light.pixels(), 1.0);
    for (std::size_t i = 0; i < light.pixels(); ++i) {
      const double mirror = 2.0 * light.cosine[i] * light.cosine[i] - 1.0;
      if (mirror > 0.0) factor[i] += strength * std::pow(mirror, exponent);
    }
    for (std::size_t i = 0; i < light.pixels(); ++i) light.steady[i] *= factor[i];
    for (std::size_t i = 0; i < light.phasors.size(); ++i) light.phasors[i] *= factor[i % light.pixels()];
  }
};

}  // namespace

Row glossyPaint() {
  return rowOf<GlossyPaint>(
      {.name = "glossy_paint",
       .summary =
           "the boards shine where they are seen straight on: an error of the scene's, not of the camera",
       .stage = Stage::Light,
       .unit = "share more, seen straight on",
       .covariates = "incidence [position, neighbours]",
       .catalogue = ""});
}

}  // namespace toftwin::reference
