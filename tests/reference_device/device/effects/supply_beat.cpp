// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <cmath>
#include <numbers>

namespace toftwin::reference {
namespace {

struct SupplyBeat final : Hidden {
  double period = 3.3;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm");
    v.number("period", period, {0.1, 1e6}, "frames");
  }
  void onLight(Light& light, const Transport& transport, const Circumstances& now) const override {
    const double late = strength * std::sin(2.0 * std::numbers::pi * static_cast<double>(now.frame) / period);
    delayEach(light, transport, [&](std::size_t) { return late; });
  }
};

}  // namespace

Row supplyBeat() {
  return rowOf<SupplyBeat>(
      {.name = "supply_beat",
       .summary = "the supply's ripple beats with the frames: late and early, in no whole number of frames",
       .stage = Stage::Light,
       .unit = "mm",
       .covariates = "frame",
       .catalogue = ""});
}

}  // namespace toftwin::reference
