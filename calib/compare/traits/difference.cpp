// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/difference.h"

#include <algorithm>
#include <cmath>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {
namespace {

constexpr double kLevel = 0.95;
constexpr double kManyDegrees = 1e6;  ///< Student's quantile is the normal one there

constexpr double kFarthest_mm = 1e5;  ///< no camera reads 100 m

}  // namespace

bool isKnown(double end, const std::string& unit) {
  return std::isfinite(end) && (unit != "mm" || std::abs(end) < kFarthest_mm);
}

Trait differenceOf(const Trait& first, const Trait& second, double wider) {
  Trait d{.name = second.name, .unit = second.unit, .value = second.value - first.value};
  d.low = d.value - wider * std::hypot(second.value - second.low, first.high - first.value);
  d.high = d.value + wider * std::hypot(second.high - second.value, first.value - first.low);
  d.n = std::min(first.n, second.n);
  return d;
}

double widenedFor(std::size_t count) {
  const double m = std::max(1.0, static_cast<double>(count));
  return studentT(kManyDegrees, std::pow(kLevel, 1.0 / m)) / studentT(kManyDegrees, kLevel);
}

Trait widened(Trait one, double wider) {
  one.low = one.value - wider * (one.value - one.low), one.high = one.value + wider * (one.high - one.value);
  return one;
}

}  // namespace toftwin::compare
