// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

#include <cmath>
#include <numbers>

namespace toftwin::reference {
namespace {

struct ColumnDelay final : Hidden {
  int period = 5;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "mm");
    v.number("period", period, {2, 64}, "columns");
  }
  void onLight(Light& light, const Transport& transport, const Circumstances&) const override {
    const auto width = static_cast<std::size_t>(light.width), m = static_cast<std::size_t>(period);
    delayEach(light, transport, [&](std::size_t i) {
      return strength * std::cos(2.0 * std::numbers::pi * static_cast<double>(i % width % m) / period);
    });
  }
};

}  // namespace

Row columnDelay() {
  return rowOf<ColumnDelay>({.name = "column_delay",
                             .summary = "the clock reaches every m-th column late",
                             .stage = Stage::Light,
                             .unit = "mm",
                             .covariates = "position",
                             .catalogue = ""});
}

}  // namespace toftwin::reference
