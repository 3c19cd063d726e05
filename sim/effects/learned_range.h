// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sim/effects/effect.h"
#include "sim/effects/learned_table.h"

namespace toftwin::sim {

/// An error of the range and of the amplitude that measurements showed and no other effect explains, as a table:
///     r → r + t(x),  A → A (1 + g(x))    or    the same with t(x, y), g(x, y)
/// with x and y whatever the error goes with; t and g linear (bilinear) between their knots and constant
/// beyond them. What `toftwin discover` writes for an effect that has no name yet.
struct LearnedRange {
  using Over = LearnedOver;
  Over over = Over::Range;
  std::vector<double> knots{1.0, 2.0, 3.0};
  Over and_over = Over::Nothing;
  std::vector<double> and_knots{};
  std::vector<double> offsets_mm{0.0, 3.0, -1.0};
  std::vector<double> gains_percent{};

  static constexpr About about{
      .name = "learned_range",
      .summary = "an error of range or amplitude learned from measurements: a table over one or two covariates",
      .reference = "docs/discover-campaigns.md",
      .explains = {Covariate::Range}};
  static LearnedRange none() { return {.knots = {}, .offsets_mm = {}, .gains_percent = {}}; }

  template <class Visitor>
  void visit(Visitor& v) {
    chooseLearnedOver<kLearnedOfLight, 0>(
        v, "over", over, "x: what the error goes with; the radius is about the principal point");
    v.numbers("knots", knots, {-1e12, 1e12}, "values of x, ascending; none: nothing is done");
    chooseLearnedOver<kLearnedOfLight, 0>(v, "and_over", and_over, "y: what else it goes with");
    v.numbers("and_knots", and_knots, {-1e12, 1e12}, "values of y, ascending");
    v.numbers("offsets_mm", offsets_mm, {-10'000.0, 10'000.0},
              "t at each knot; with y: for the first x all y, then for the next x; none: 0");
    v.numbers("gains_percent", gains_percent, {-100.0, 10'000.0},
              "g likewise: by how much the amplitude is larger; none: 0");
  }
  /// What no single key can say of what is wrong, or nothing.
  [[nodiscard]] std::string problem() const {
    return problemOf({knots, and_knots}, over, and_over, {"offsets_mm", offsets_mm}, gains_percent);
  }
  /// t, in millimetres. NaN where x or y is not known.
  [[nodiscard]] double offset_mm(double x, double y = 0.0) const {
    return LearnedKnots{knots, and_knots}.valueIn(offsets_mm, x, y);
  }
  /// g, likewise.
  [[nodiscard]] double gain_percent(double x, double y = 0.0) const {
    return LearnedKnots{knots, and_knots}.valueIn(gains_percent, x, y);
  }
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
