// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <cmath>

namespace toftwin::reference {
namespace {

struct WarmUp final : Hidden {
  double time_s = 600.0;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm when cold");
    v.number("time_s", time_s, {1.0, 1e6}, "time constant");
  }
  void onLight(Light& light, const Transport& transport, const Circumstances& now) const override {
    const double late = -strength * std::exp(-now.since_power_on_s / time_s);
    delayEach(light, transport, [&](std::size_t) { return late; });
  }
};

}  // namespace

Row warmUp() {
  return rowOf<WarmUp>({.name = "warm_up",
                        .summary = "reads near when cold, and less from minute to minute",
                        .stage = Stage::Light,
                        .unit = "mm when cold",
                        .covariates = "time [temperature]",
                        .catalogue = "warm_up"});
}

}  // namespace toftwin::reference
