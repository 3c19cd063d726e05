// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

namespace toftwin::reference {
namespace {

struct RayOffset final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm");
  }
  [[nodiscard]] double leastTransfer_m() const override { return 1e-3 * strength; }
};

}  // namespace

Row rayOffset() {
  return rowOf<RayOffset>(
      {.name = "ray_offset",
       .summary = "light between places nearer than this is missing, as with a renderer's ray offset",
       .stage = Stage::Light,
       .unit = "mm",
       .covariates = "multipath [neighbours, position, range]",
       .catalogue = ""});
}

}  // namespace toftwin::reference
