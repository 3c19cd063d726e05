// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Light or reference takes a constant extra way through cables and drivers:  r → r + offset, the
/// same for every frequency and pixel. Acts after decoding: it does not wrap, and it does not shift
/// the wiggling. A delay that does both belongs into the waveform (`rise_ns`).
struct Delay {
  Length offset = 10_mm;

  static constexpr About about{
      .name = "delay",
      .summary = "a constant offset of the range, positive: reads too far",
      .reference = "R. Lange, 3D time-of-flight distance measurement (2000), section 5",
      .explains = {}};
  static Delay none() { return {.offset = 0_mm}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.quantity("offset", offset, millimetre, {-10'000.0, 10'000.0}, "added to every range");
  }
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now,
                                 const Random& random) const;
};

}  // namespace toftwin::sim
