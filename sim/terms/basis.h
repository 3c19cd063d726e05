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
  /// Of a Curve: what it is from one knot to the next. The first piece lies before the first knot, the last ends at infinity; both are constant.
  struct Piece {
    double next, from, value, slope;
  };
  std::vector<Piece> pieces_;
  /// For each of equal intervals of x, the piece that it begins in; empty where two knots share an interval.
  std::vector<std::int32_t> before_;
  double first_ = 0.0, intervals_per_x_ = 0.0;
};

}  // namespace toftwin::terms
