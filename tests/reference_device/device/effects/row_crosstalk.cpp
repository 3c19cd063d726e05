// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/effects/effects.h"

namespace toftwin::reference {
namespace {

struct RowCrosstalk final : Hidden {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strength", strength, {-1e9, 1e9}, "share of the row's mean");
  }
  void onSamples(Charges& charges, const Light& light, const Circumstances&) const override {
    const auto width = static_cast<std::size_t>(light.width);
    for (std::size_t row = 0; row < charges.taps.size(); row += width) {
      double sum = 0.0;
      for (std::size_t x = 0; x < width; ++x) sum += charges.taps[row + x];
      for (std::size_t x = 0; x < width; ++x)
        charges.taps[row + x] += strength * sum / static_cast<double>(width);
    }
  }
};

}  // namespace

Row rowCrosstalk() {
  return rowOf<RowCrosstalk>(
      {.name = "row_crosstalk",
       .summary = "a row's converters share a reference, which moves with all that the row holds",
       .stage = Stage::Samples,
       .unit = "share of the row's mean",
       .covariates = "neighbours [amplitude, range, position]",
       .catalogue = ""});
}

}  // namespace toftwin::reference
