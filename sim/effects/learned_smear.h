// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// What the ranges about a pixel are farther than itself, in metres: half of the left one's less the right one's, half of the
/// upper one's less the lower one's, and the mean of all eight less its own.
struct Smears {
  float across = 0.0F, along = 0.0F, around = 0.0F;
};
/// At (x, y). All 0 at the image's edge and beside a range that is NaN.
Smears smearsAt(const Image<float>& range_m, int x, int y);

/// Ranges that come from their neighbours', learned from measurements that no other effect explains:
///     r → r + a(A) ½(r₋₁,₀ − r₁,₀) + b(A) ½(r₀,₋₁ − r₀,₁) + c(A) (⟨r⟩₈ − r)
/// with shares a, b, c linear between knots over the pixel's amplitude A and constant beyond them. The amplitude is as it was.
/// What `toftwin discover` writes for a firmware's filter that has no name.
struct LearnedSmear {
  std::vector<double> amplitudes_e{500.0, 2000.0};
  std::vector<double> across_percent{5.0, 1.0}, along_percent{0.0, 0.0}, around_percent{10.0, 2.0};

  static constexpr About about{
      .name = "learned_smear",
      .summary = "ranges from neighbours learned from measurements: shares over the amplitude",
      .reference = "docs/discover-campaigns.md",
      .explains = {Covariate::Exposure, Covariate::Amplitude, Covariate::Range, Covariate::Neighbours}};
  static LearnedSmear none() {
    return {.amplitudes_e = {0.0}, .across_percent = {0.0}, .along_percent = {0.0}, .around_percent = {0.0}};
  }

  template <class Visitor>
  void visit(Visitor& v) {
    v.numbers("amplitudes_e", amplitudes_e, {0.0, 1e12}, "values of A, ascending; none: nothing is done");
    v.numbers("across_percent", across_percent, {-100.0, 100.0}, "a at each: of the left pixel instead of the right one");
    v.numbers("along_percent", along_percent, {-100.0, 100.0}, "b at each: of the upper pixel instead of the lower one");
    v.numbers("around_percent", around_percent, {-100.0, 100.0}, "c at each: of the eight about it instead of its own");
  }
  /// What no single key can say of what is wrong, or nothing.
  [[nodiscard]] std::string problem() const;
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
