// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/difference.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {
namespace {

constexpr double kLevel = 0.95;
constexpr double kManyDegrees = 1e6;  ///< Student's quantile is the normal one there

constexpr double kFarthest_mm = 1e5;  ///< no camera reads 100 m

/// What an interval of Student's is to be widened by for the level to which normal ones are by `wider`.
double widerOf(const Trait& one, double wider) {
  if (!(one.degrees < kManyDegrees) || !(wider > 1.0)) return wider;
  const double level = std::erf(wider * studentT(kManyDegrees, kLevel) / std::numbers::sqrt2);
  return studentT(one.degrees, level) / studentT(one.degrees, kLevel);
}

}  // namespace

bool isKnown(double end, const std::string& unit) {
  return std::isfinite(end) && (unit != "mm" || std::abs(end) < kFarthest_mm);
}

Trait differenceOf(const Trait& first, const Trait& second, double wider) {
  constexpr double kRounding = 1e-12;  // of means of equal numbers, which differ by how they were added
  Trait d{.name = second.name, .unit = second.unit, .value = second.value - first.value};
  if (std::abs(d.value) <= kRounding * std::abs(first.value)) d.value = 0.0;
  const double of_first = widerOf(first, wider), of_second = widerOf(second, wider);
  d.low = d.value - std::hypot(of_second * (second.value - second.low), of_first * (first.high - first.value));
  d.high = d.value + std::hypot(of_second * (second.high - second.value), of_first * (first.value - first.low));
  d.n = std::min(first.n, second.n);
  return d;
}

double widenedFor(std::size_t count) {
  const double m = std::max(1.0, static_cast<double>(count));
  return studentT(kManyDegrees, std::pow(kLevel, 1.0 / m)) / studentT(kManyDegrees, kLevel);
}

Trait widened(Trait one, double wider) {
  wider = widerOf(one, wider);
  one.low = one.value - wider * (one.value - one.low), one.high = one.value + wider * (one.high - one.value);
  return one;
}

}  // namespace toftwin::compare
