// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sim/terms/term.h"

namespace toftwin::terms {

/// A basis made ready for many x. Gives the same bits as valueOf(factor, x).
class BasisOfMany {
 public:
  explicit BasisOfMany(const Factor& factor);
  /// product[i] *= basis(x[i]). Both of the same size.
  void multiply(std::span<const double> x, std::span<double> product) const;

 private:
  void multiplyCurve(std::span<const double> x, std::span<double> product) const;

  Basis basis_;
  std::vector<double> numbers_;
  /// Of a Curve: its knots with one at infinity after the last, and value and slope from each on. Before the first
  /// knot comes one at minus infinity, so that both ends are constant.
  std::vector<double> knots_, values_, slopes_, from_;
  /// For each of equal intervals of x, the last knot before it; empty where two knots share an interval.
  std::vector<std::int32_t> before_;
  double first_ = 0.0, intervals_per_x_ = 0.0;
};

}  // namespace toftwin::terms
