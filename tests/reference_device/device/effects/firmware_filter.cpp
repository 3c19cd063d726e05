// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <cmath>

namespace toftwin::reference {
namespace {

struct FirmwareFilter final : Hidden {
  double below_electrons = 2500.0;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "share of the left neighbour");
    v.number("below_electrons", below_electrons, {0.0, 1e9}, "of amplitude");
  }
  void onRange(Measured& measured, const Light&, const Circumstances&) const override {
    for (std::size_t i = 1; i < measured.range_m.size(); ++i) {
      if (i % static_cast<std::size_t>(measured.width) == 0 ||
          measured.amplitude[i] > static_cast<float>(below_electrons))
        continue;
      const float left = measured.range_m[i - 1];
      if (!std::isnan(left))
        measured.range_m[i] += static_cast<float>(strength) * (left - measured.range_m[i]);
    }
  }
};

}  // namespace

Row firmwareFilter() {
  return rowOf<FirmwareFilter>(
      {.name = "firmware_filter",
       .summary = "ranges are smeared along the row, from left to right, where the signal is weak",
       .stage = Stage::Range,
       .unit = "share of the left neighbour",
       .covariates = "neighbours [amplitude]",
       .catalogue = ""});
}

}  // namespace toftwin::reference
