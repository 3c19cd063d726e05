// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// The demodulation signal runs along the chip and reaches far columns and rows later, or from the middle
/// row outwards. Light is then seen nearer or farther by
///     δ(x, y) = α (x − x_m) + β (y − y_m) + γ |y − y_m|
/// of range, x_m, y_m the middle of the image:  Pₙ → Pₙ · exp(−i 4π n f δ / c), the same millimetres at
/// every frequency, constant from frame to frame.
struct PropagationDelay {
  Length per_column = 0.02_mm;
  Length per_row = 0_mm;
  Length per_row_from_middle = 0_mm;

  static constexpr About about{
      .name = "propagation_delay",
      .summary = "the demodulation signal reaches columns and rows one after the other: a tilted image",
      .reference = "ESPROS on row addressing differences; the Kinect v2's halves are read from the middle",
      .explains = {Covariate::Position}};
  static PropagationDelay none() { return {.per_column = 0_mm}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.quantity("per_column", per_column, millimetre, {-10.0, 10.0},
               "alpha, of range; positive: the right reads farther");
    v.quantity("per_row", per_row, millimetre, {-10.0, 10.0},
               "beta; positive: the bottom reads farther");
    v.quantity("per_row_from_middle", per_row_from_middle, millimetre, {-10.0, 10.0},
               "gamma; positive: top and bottom read farther than the middle");
  }
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
