// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sim/effects/effect.h"
#include "sim/effects/learned_table.h"

namespace toftwin::sim {

/// A delay and a gain of the camera's own light that measurements showed and no other effect explains, as a
/// table over what only light knows: how it meets the surface, its albedo, and how bright the surroundings are.
///     Pₙ → Pₙ (1 + g(x)) exp(−i 4π n f t(x)/c)    or the same with t(x, y), g(x, y)
/// t and g are linear (bilinear) between their knots and constant beyond them. Surroundings are compared by
/// the camera's own unmodulated light. Incidence, albedo and range are the scene's, so that where nobody knows the
/// scene nothing is done. What `toftwin discover` writes for an effect that has no name yet; see
/// LearnedRange.
struct LearnedLight {
  using Over = LearnedOver;
  Over over = Over::Surround16;
  std::vector<double> knots{-1.0, 0.0, 1.0};
  Over and_over = Over::Nothing;
  std::vector<double> and_knots{};
  std::vector<double> delays_mm{-2.0, 0.0, 5.0};
  std::vector<double> gains_percent{};

  static constexpr About about{.name = "learned_light",
                               .summary =
                                   "a delay or gain of the light learned from measurements: a table over "
                                   "incidence, surroundings or others",
                               .reference = "docs/discover-campaigns.md",
                               .explains = {Covariate::Amplitude, Covariate::Neighbours}};
  static LearnedLight none() { return {.knots = {}, .delays_mm = {}, .gains_percent = {}}; }

  template <class Visitor>
  void visit(Visitor& v) {
    chooseLearnedOver<0, kLearnedOfImage>(
        v, "over", over, "x: what it goes with; incidence is 1/cos, a surrounding ln(mean of a square/own)");
    v.numbers("knots", knots, {-1e12, 1e12}, "values of x, ascending; none: nothing is done");
    chooseLearnedOver<0, kLearnedOfImage>(v, "and_over", and_over, "y: what else it goes with");
    v.numbers("and_knots", and_knots, {-1e12, 1e12}, "values of y, ascending");
    v.numbers("delays_mm", delays_mm, {-10'000.0, 10'000.0},
              "t at each knot, of range; with y: for the first x all y, then for the next x; none: 0");
    v.numbers("gains_percent", gains_percent, {-100.0, 10'000.0},
              "g likewise: by how much the light is brighter; none: 0");
  }
  /// What no single key can say of what is wrong, or nothing.
  [[nodiscard]] std::string problem() const {
    return problemOf({knots, and_knots}, over, and_over, {"delays_mm", delays_mm}, gains_percent);
  }
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
