// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

namespace toftwin::reference {
namespace {

struct FrameParity final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm");
  }
  void onLight(Light& light, const Transport& transport, const Circumstances& now) const override {
    delayEach(light, transport, [&](std::size_t) { return now.frame % 2 == 0 ? strength : -strength; });
  }
};

}  // namespace

Row frameParity() {
  return rowOf<FrameParity>(
      {.name = "frame_parity",
       .summary = "every other frame is late, the ones between early: nothing on the average of two",
       .stage = Stage::Light,
       .unit = "mm",
       .covariates = "frame",
       .catalogue = ""});
}

}  // namespace toftwin::reference
