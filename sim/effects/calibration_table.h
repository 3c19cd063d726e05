// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// The factory's table of corrections over range, as cameras hold it:
///     r → r + t(r),   t linear between knots at first + i · spacing, constant beyond the ends
/// Up to 49 knots, as pulsed cameras of Analog Devices have. It linearises a device that needs it; with
/// another device's table it is an error.
struct CalibrationTable {
  Length first = 500_mm;
  Length spacing = 500_mm;
  std::vector<double> offsets_mm{0.0, 3.0, -2.0, 4.0, -1.0, 2.0, 0.0};

  static constexpr std::size_t kMostKnots = 49;
  static constexpr About about{
      .name = "calibration_table",
      .summary = "a correction of the range by a table over the range, linear between its knots",
      .reference = "aditof_sdk: depth_offset[49], the distance linearisation of pulsed cameras",
      .explains = {Covariate::Range}};
  static CalibrationTable none() { return {.offsets_mm = {}}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.quantity("first", first, millimetre, {0.0, 1e6}, "range of the first knot");
    v.quantity("spacing", spacing, millimetre, {1.0, 1e6}, "from knot to knot");
    v.numbers("offsets_mm", offsets_mm, {-10'000.0, 10'000.0},
              "added at each knot, at most 49; none: no table");
  }
  /// What no single key can say of what is wrong, or nothing.
  [[nodiscard]] std::string problem() const;
  /// t at a range.
  [[nodiscard]] double offset_mm(double range_m) const;
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now,
                                 const Random& random) const;
};

}  // namespace toftwin::sim
