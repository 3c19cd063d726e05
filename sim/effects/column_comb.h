// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Every m-th column shares a converter, and converters differ: for column class j = x mod m
///     S → S (1 + g_j) + o_{i,j},   g_j and o_{i,j} normal, of standard deviations `gain` and `offset`
/// i the raw exposure and tap. An offset that were the same for all steps would cancel in the phase.
/// `device` chooses which of all cameras of this make it is; the pattern never changes.
struct ColumnComb {
  int period = 4;
  double offset_electrons = 20.0;
  double gain = 0.001;
  std::uint32_t device = 1;

  static constexpr About about{
      .name = "column_comb",
      .summary = "converters of columns differ in offset and gain: vertical stripes that repeat",
      .reference = "EMVA Standard 1288, release 4.0, section 4 (column non-uniformity)",
      .explains = {Covariate::Ambient, Covariate::Exposure, Covariate::Amplitude, Covariate::Range,
                   Covariate::Position}};
  static ColumnComb none() { return {.offset_electrons = 0.0, .gain = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("period", period, {1, 4096}, "m, columns after which the pattern repeats");
    v.number("offset_electrons", offset_electrons, {0.0, 1e6}, "standard deviation of the offsets");
    v.number("gain", gain, {0.0, 0.2}, "standard deviation of the gains, as a share");
    v.number("device", device, {0.0, 4294967295.0},
             "which camera of this make: another number, another pattern");
  }
  [[nodiscard]] Samples apply(Samples samples, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
