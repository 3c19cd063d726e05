// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

namespace toftwin::reference {
namespace {

struct RailScale final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm per metre of way");
  }
  [[nodiscard]] Vec3d misplaced_m(const Transform<World, Camera>& commanded) const override {
    return 1e-3 * strength * commanded.translation_m;
  }
};

}  // namespace

Row railScale() {
  return rowOf<RailScale>(
      {.name = "rail_scale",
       .summary = "the rig goes farther than it says: an error of the reference, not of the camera",
       .stage = Stage::Light,
       .unit = "mm per metre of way",
       .covariates = "pose [range]",
       .catalogue = ""});
}

}  // namespace toftwin::reference
