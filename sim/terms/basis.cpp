// SPDX-License-Identifier: Apache-2.0
#include "sim/terms/basis.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include <toftwin/nan.h>

#include "sim/images/simd.h"

namespace toftwin::terms {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

inline double finiteOrNan(double value) { return std::abs(value) < kInfinity ? value : kNaN; }

/// sin(2π u), by the Taylor series of the quarter turn that it is folded into, whose next member is below 1e-18.
/// Turns instead of radians, so that the period is exact; the same bits whether one or many are computed.
inline double sineOfTurns(double turns) {
  const double u = turns - std::floor(turns + 0.5);            // −½ … ½
  const double v = 0.25 - std::abs(std::abs(u) - 0.25);        // sin 2π|u| = sin 2πv, 0 ≤ v ≤ ¼
  const double z = 2.0 * std::numbers::pi * v, z2 = z * z;
  double sum = 1.0 / 51090942171709440000.0;                   // 1/21!, then 1/19! and so on
  sum = sum * z2 - 1.0 / 121645100408832000.0;
  sum = sum * z2 + 1.0 / 355687428096000.0;
  sum = sum * z2 - 1.0 / 1307674368000.0;
  sum = sum * z2 + 1.0 / 6227020800.0;
  sum = sum * z2 - 1.0 / 39916800.0;
  sum = sum * z2 + 1.0 / 362880.0;
  sum = sum * z2 - 1.0 / 5040.0;
  sum = sum * z2 + 1.0 / 120.0;
  sum = sum * z2 - 1.0 / 6.0;
  return std::copysign(z + z * z2 * sum, u);
}

inline double cosineOfTurns(double turns) {
  const double u = turns - std::floor(turns + 0.5);
  return sineOfTurns(0.25 - std::abs(u));
}

inline double radians(double degrees) { return degrees * (std::numbers::pi / 180.0); }

inline double powerAt(double x, double n) {
  if (n == 1.0) return x;
  if (n == 2.0) return x * x;
  return std::isnan(x) ? x : std::pow(x, n);
}
inline double sawtoothAt(double x, double period, double a) {
  const double turns = (x - a) / period;
  return turns - std::floor(turns) - 0.5;
}
inline double stepAt(double x, double a) { return std::isnan(x) ? x : (x >= a ? 1.0 : 0.0); }
inline double sigmoidAt(double x, double a, double w) { return 1.0 / (1.0 + std::exp(-(x - a) / w)); }
inline double hingeAt(double x, double a) { return std::isnan(x) ? x : std::max(0.0, x - a); }
inline double bumpAt(double x, double a, double w) {
  const double far = (x - a) / w;
  return std::exp(-0.5 * far * far);
}
inline double hatAt(double x, double a, double b, double c) {
  if (std::isnan(x)) return x;
  if (x == b) return 1.0;
  if (x < b) return a == -kInfinity ? 1.0 : (x <= a ? 0.0 : (x - a) / (b - a));
  return c == kInfinity ? 1.0 : (x >= c ? 0.0 : (c - x) / (c - b));
}
inline double classAt(double x, double m, double k) {
  const double whole = std::floor(x);
  return std::isnan(x) ? x : (whole - m * std::floor(whole / m) == k ? 1.0 : 0.0);
}
inline double secantAt(double degrees) {
  return std::abs(degrees) < 90.0 ? 1.0 / std::cos(radians(degrees)) - 1.0 : kNaN;
}
inline double tangent2At(double degrees) {
  const double tangent = std::tan(radians(degrees));
  return std::abs(degrees) < 90.0 ? tangent * tangent : kNaN;
}

double curveAt(double x, const std::vector<double>& n) {
  if (!std::isfinite(x) || n.size() < 2) return kNaN;
  if (x < n[0]) return n[1];
  std::size_t low = 0, high = n.size() / 2;  // the knot at or before x is low … high − 1
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    (n[2 * middle] <= x ? low : high) = middle;
  }
  if (2 * low + 2 >= n.size()) return n[2 * low + 1];
  const double x0 = n[2 * low], y0 = n[2 * low + 1];
  return y0 + (x - x0) * ((n[2 * low + 3] - y0) / (n[2 * low + 2] - x0));
}

double unchecked(Basis basis, double x, const std::vector<double>& n) {
  switch (basis) {
    case Basis::Power:
      return powerAt(x, n[0]);
    case Basis::Log:
      return x > 0.0 ? std::log(x) : kNaN;
    case Basis::Decay:
      return std::exp(-x / n[0]);
    case Basis::Sine:
      return sineOfTurns(x / n[0]);
    case Basis::Cosine:
      return cosineOfTurns(x / n[0]);
    case Basis::Sawtooth:
      return sawtoothAt(x, n[0], n[1]);
    case Basis::Step:
      return stepAt(x, n[0]);
    case Basis::Sigmoid:
      return sigmoidAt(x, n[0], n[1]);
    case Basis::Hinge:
      return hingeAt(x, n[0]);
    case Basis::Bump:
      return bumpAt(x, n[0], n[1]);
    case Basis::Hat:
      return hatAt(x, n[0], n[1], n[2]);
    case Basis::Curve:
      return curveAt(x, n);
    case Basis::Class:
      return classAt(x, n[0], n[1]);
    case Basis::Secant:
      return secantAt(x);
    case Basis::Tangent2:
      return tangent2At(x);
    case Basis::Level:
      break;
  }
  return kNaN;
}

/// One loop for each basis whose values are worth computing several at a time.
TOFTWIN_SIMD void multiplyLoops(Basis basis, const double* n, const double* x, double* product, std::size_t count) {
  switch (basis) {
    case Basis::Sine:
      for (std::size_t i = 0; i < count; ++i) product[i] *= finiteOrNan(sineOfTurns(x[i] / n[0]));
      return;
    case Basis::Cosine:
      for (std::size_t i = 0; i < count; ++i) product[i] *= finiteOrNan(cosineOfTurns(x[i] / n[0]));
      return;
    case Basis::Sawtooth:
      for (std::size_t i = 0; i < count; ++i) product[i] *= finiteOrNan(sawtoothAt(x[i], n[0], n[1]));
      return;
    case Basis::Step:
      for (std::size_t i = 0; i < count; ++i) product[i] *= finiteOrNan(stepAt(x[i], n[0]));
      return;
    case Basis::Hinge:
      for (std::size_t i = 0; i < count; ++i) product[i] *= finiteOrNan(hingeAt(x[i], n[0]));
      return;
    case Basis::Hat:
      for (std::size_t i = 0; i < count; ++i) product[i] *= finiteOrNan(hatAt(x[i], n[0], n[1], n[2]));
      return;
    case Basis::Class:
      for (std::size_t i = 0; i < count; ++i) product[i] *= finiteOrNan(classAt(x[i], n[0], n[1]));
      return;
    default:
      return;
  }
}

bool hasLoop(Basis basis) {
  constexpr Basis kWithLoops[] = {Basis::Sine,  Basis::Cosine, Basis::Sawtooth, Basis::Step,
                                  Basis::Hinge, Basis::Hat,    Basis::Class};
  return std::ranges::find(kWithLoops, basis) != std::end(kWithLoops);
}

/// A curve's tables; see BasisOfMany. Each is a parameter of its own that nobody else writes to, so that GCC gathers values
/// several at a time.
TOFTWIN_SIMD void multiplyCurveLoop(const double* __restrict knots, const double* __restrict from,
                                    const double* __restrict values, const double* __restrict slopes,
                                    const std::int32_t* __restrict before, double first, double intervals_per_x,
                                    double last_interval, const double* __restrict x, double* __restrict product,
                                    std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const double at = x[i];
    double interval = (at - first) * intervals_per_x;
    interval = interval > 0.0 ? interval : 0.0;  // also of NaN
    interval = interval < last_interval ? interval : last_interval;
    const std::int32_t below = before[static_cast<std::int32_t>(interval)];
    const std::int32_t knot = below + (at >= knots[below + 1] ? 1 : 0);
    product[i] *= finiteOrNan(values[knot] + (at - from[knot]) * slopes[knot]);
  }
}

}  // namespace

double valueOf(const Factor& factor, double x) { return finiteOrNan(unchecked(factor.basis, x, factor.numbers)); }

BasisOfMany::BasisOfMany(const Factor& factor) : basis_(factor.basis), numbers_(factor.numbers) {
  if (basis_ != Basis::Curve || numbers_.size() < 4) return;
  const std::size_t count = numbers_.size() / 2;
  knots_.push_back(-kInfinity), from_.push_back(numbers_[0]), values_.push_back(numbers_[1]), slopes_.push_back(0.0);
  double least = kInfinity;
  for (std::size_t k = 0; k < count; ++k) {
    const double x = numbers_[2 * k], y = numbers_[2 * k + 1];
    const bool is_last = k + 1 == count;
    knots_.push_back(x), from_.push_back(x), values_.push_back(y);
    slopes_.push_back(is_last ? 0.0 : (numbers_[2 * k + 3] - y) / (numbers_[2 * k + 2] - x));
    if (!is_last) least = std::min(least, numbers_[2 * k + 2] - x);
  }
  knots_.push_back(kInfinity);
  first_ = numbers_[0];
  constexpr double kMostIntervals = 4096.0;
  const double span = numbers_[2 * count - 2] - first_, intervals = std::floor(1.5 * span / least) + 2.0;
  if (!(intervals <= kMostIntervals)) return;
  intervals_per_x_ = (intervals - 1.0) / span;
  before_.assign(static_cast<std::size_t>(intervals), 0);
  std::vector<int> within(before_.size(), 0);
  for (std::size_t k = 1; k <= count; ++k) {
    // The same arithmetic as where it is looked up: then no rounding can put a knot on the wrong side.
    const double interval = std::clamp((knots_[k] - first_) * intervals_per_x_, 0.0, intervals - 1.0);
    const auto i = static_cast<std::size_t>(interval);
    ++within[i];
    for (std::size_t later = i + 1; later < before_.size(); ++later) before_[later] = static_cast<std::int32_t>(k);
  }
  if (std::ranges::any_of(within, [](int knots) { return knots > 1; })) before_.clear();
}

void BasisOfMany::multiplyCurve(std::span<const double> x, std::span<double> product) const {
  multiplyCurveLoop(knots_.data(), from_.data(), values_.data(), slopes_.data(), before_.data(), first_, intervals_per_x_,
                    static_cast<double>(before_.size() - 1), x.data(), product.data(), x.size());
}

void BasisOfMany::multiply(std::span<const double> x, std::span<double> product) const {
  if (!before_.empty()) return multiplyCurve(x, product);
  if (hasLoop(basis_)) return multiplyLoops(basis_, numbers_.data(), x.data(), product.data(), x.size());
  for (std::size_t i = 0; i < x.size(); ++i) product[i] *= finiteOrNan(unchecked(basis_, x[i], numbers_));
}

}  // namespace toftwin::terms
