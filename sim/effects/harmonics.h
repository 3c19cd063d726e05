// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// The correlation function holds more of some harmonics than the camera file's waveforms say:
///     ĉₙ → ĉₙ + hₙ,   relative to the fundamental, the same at every frequency
/// An excess that N steps cannot tell from the fundamental (n = mN ± 1) becomes a cyclic error of the
/// range of hₙ radians; the others show where samples contradict each other.
struct Harmonics {
  double second = 0.0, third = 0.05, fourth = 0.0, fifth = 0.0;

  static constexpr About about{
      .name = "harmonics",
      .summary = "the correlation function is not quite the one that the camera file's waveforms make",
      .reference = "M. Lindner, A. Kolb 2006 (wiggling); closed form in the page",
      .explains = {Covariate::Range}};
  static Harmonics none() { return {.third = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("second", second, {-1.0, 1.0}, "h2, relative to the fundamental");
    v.number("third", third, {-1.0, 1.0}, "h3, the same");
    v.number("fourth", fourth, {-1.0, 1.0}, "h4, the same");
    v.number("fifth", fifth, {-1.0, 1.0}, "h5, the same");
  }
  /// The highest harmonic that it changes: light must be traced with as many.
  [[nodiscard]] int highest() const;
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
