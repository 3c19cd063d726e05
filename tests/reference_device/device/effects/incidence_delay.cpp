// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <algorithm>
#include <cmath>

namespace toftwin::reference {
namespace {

struct IncidenceDelay final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm for each 1 / cos - 1");
  }
  void onLight(Light& light, const Transport& transport, const Circumstances&) const override {
    delayEach(light, transport, [&](std::size_t i) {
      return std::isnan(light.cosine[i]) ? 0.0 : strength * (1.0 / std::max(light.cosine[i], 0.05) - 1.0);
    });
  }
};

}  // namespace

Row incidenceDelay() {
  return rowOf<IncidenceDelay>({.name = "incidence_delay",
                                .summary = "surfaces seen aslant answer late",
                                .stage = Stage::Light,
                                .unit = "mm for each 1 / cos - 1",
                                .covariates = "incidence [position, range]",
                                .catalogue = ""});
}

}  // namespace toftwin::reference
