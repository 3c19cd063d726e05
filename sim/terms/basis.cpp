// SPDX-License-Identifier: Apache-2.0
#include "sim/terms/basis.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include <toftwin/nan.h>

#include "sim/images/simd.h"
#include "sim/terms/elementary.h"

namespace toftwin::terms {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TOFTWIN_TERMS_INLINE double finiteOrNan(double value) { return std::abs(value) < kInfinity ? value : kNaN; }

TOFTWIN_TERMS_INLINE double radians(double degrees) { return degrees * (std::numbers::pi / 180.0); }

/// Exponents that are a few operations, and what they are. `use` is called with a function of x.
template <class Use>
TOFTWIN_TERMS_INLINE bool withPower(double n, const Use& use) {
  if (n == 1.0) return use([](double x) { return x; }), true;
  if (n == 2.0) return use([](double x) { return x * x; }), true;
  if (n == 3.0) return use([](double x) { return x * x * x; }), true;
  if (n == -1.0) return use([](double x) { return 1.0 / x; }), true;
  if (n == -2.0) return use([](double x) { return 1.0 / (x * x); }), true;
  if (n == 0.5) return use([](double x) { return std::sqrt(x); }), true;
  if (n == -0.5) return use([](double x) { return 1.0 / std::sqrt(x); }), true;
  return false;
}
double powerAt(double x, double n) {
  double value = kNaN;
  if (!withPower(n, [&](const auto& power) { value = power(x); })) value = std::isnan(x) ? x : std::pow(x, n);
  return value;
}
TOFTWIN_TERMS_INLINE double sawtoothAt(double x, double period, double a) {
  const double turns = (x - a) / period;
  return turns - std::floor(turns) - 0.5;
}
TOFTWIN_TERMS_INLINE double stepAt(double x, double a) { return std::isnan(x) ? x : (x >= a ? 1.0 : 0.0); }
TOFTWIN_TERMS_INLINE double sigmoidAt(double x, double a, double w) { return 1.0 / (1.0 + exponential(-(x - a) / w)); }
TOFTWIN_TERMS_INLINE double hingeAt(double x, double a) { return std::isnan(x) ? x : std::max(0.0, x - a); }
TOFTWIN_TERMS_INLINE double bumpAt(double x, double a, double w) {
  const double far = (x - a) / w;
  return exponential(-0.5 * far * far);
}
TOFTWIN_TERMS_INLINE double hatAt(double x, double a, double b, double c) {
  if (std::isnan(x)) return x;
  if (x == b) return 1.0;
  if (x < b) return a == -kInfinity ? 1.0 : (x <= a ? 0.0 : (x - a) / (b - a));
  return c == kInfinity ? 1.0 : (x >= c ? 0.0 : (c - x) / (c - b));
}
TOFTWIN_TERMS_INLINE double classAt(double x, double m, double k) {
  const double whole = std::floor(x);
  return std::isnan(x) ? x : (whole - m * std::floor(whole / m) == k ? 1.0 : 0.0);
}
TOFTWIN_TERMS_INLINE double secantAt(double degrees) {
  return std::abs(degrees) < 90.0 ? 1.0 / std::cos(radians(degrees)) - 1.0 : kNaN;
}
TOFTWIN_TERMS_INLINE double tangent2At(double degrees) {
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
      return naturalLogarithm(x);
    case Basis::Decay:
      return exponential(-x / n[0]);
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

/// One loop for each basis whose values are worth computing several at a time; false of the others.
TOFTWIN_SIMD bool multiplyLoops(Basis basis, const double* n, const double* __restrict x, double* __restrict product, std::size_t count) {
  const auto each = [&](const auto& at) __attribute__((always_inline)) {
    for (std::size_t i = 0; i < count; ++i) product[i] *= finiteOrNan(at(x[i]));
  };
  const double first = n[0], second = n[1], third = n[2];
  switch (basis) {
    case Basis::Power:
      return withPower(first, each);
    case Basis::Log:
      return each([](double at) { return naturalLogarithm(at); }), true;
    case Basis::Decay:
      return each([=](double at) { return exponential(-at / first); }), true;
    case Basis::Sine:
      return each([=](double at) { return sineOfTurns(at / first); }), true;
    case Basis::Cosine:
      return each([=](double at) { return cosineOfTurns(at / first); }), true;
    case Basis::Sawtooth:
      return each([=](double at) { return sawtoothAt(at, first, second); }), true;
    case Basis::Step:
      return each([=](double at) { return stepAt(at, first); }), true;
    case Basis::Sigmoid:
      return each([=](double at) { return sigmoidAt(at, first, second); }), true;
    case Basis::Hinge:
      return each([=](double at) { return hingeAt(at, first); }), true;
    case Basis::Bump:
      return each([=](double at) { return bumpAt(at, first, second); }), true;
    case Basis::Hat:
      return each([=](double at) { return hatAt(at, first, second, third); }), true;
    case Basis::Class:
      return each([=](double at) { return classAt(at, first, second); }), true;
    default:
      return false;
  }
}

}  // namespace

double valueOf(const Factor& factor, double x) { return finiteOrNan(unchecked(factor.basis, x, factor.numbers)); }

BasisOfMany::BasisOfMany(const Factor& factor) : basis_(factor.basis), numbers_(factor.numbers) {
  if (basis_ != Basis::Curve || numbers_.size() < 4) return;
  const std::size_t count = numbers_.size() / 2;
  const auto knotAt = [&](std::size_t k) { return k < count ? numbers_[2 * k] : kInfinity; };
  pieces_.push_back({.next = numbers_[0], .from = numbers_[0], .value = numbers_[1], .slope = 0.0});
  double least = kInfinity;
  for (std::size_t k = 0; k < count; ++k) {
    const double x = numbers_[2 * k], y = numbers_[2 * k + 1];
    const bool is_last = k + 1 == count;
    pieces_.push_back({.next = knotAt(k + 1), .from = x, .value = y, .slope = is_last ? 0.0 : (numbers_[2 * k + 3] - y) / (numbers_[2 * k + 2] - x)});
    if (!is_last) least = std::min(least, numbers_[2 * k + 2] - x);
  }
  first_ = numbers_[0];
  constexpr double kMostIntervals = 4096.0;
  const double span = numbers_[2 * count - 2] - first_, intervals = std::floor(1.5 * span / least) + 2.0;
  if (!(intervals <= kMostIntervals)) return;
  intervals_per_x_ = (intervals - 1.0) / span;
  before_.assign(static_cast<std::size_t>(intervals), 0);
  std::vector<int> within(before_.size(), 0);
  for (std::size_t k = 0; k < count; ++k) {
    // The same arithmetic as where it is looked up: then no rounding can put a knot on the wrong side.
    const double interval = std::clamp((knotAt(k) - first_) * intervals_per_x_, 0.0, intervals - 1.0);
    const auto i = static_cast<std::size_t>(interval);
    ++within[i];
    for (std::size_t later = i + 1; later < before_.size(); ++later) before_[later] = static_cast<std::int32_t>(k + 1);
  }
  if (std::ranges::any_of(within, [](int knots) { return knots > 1; })) before_.clear();
}

/// One pixel after the other: a table of 32 bytes a piece is looked up in a quarter of the time that gathering eight pixels' numbers takes.
void BasisOfMany::multiplyCurve(std::span<const double> x, std::span<double> product) const {
  const double first = first_, intervals_per_x = intervals_per_x_, last_interval = static_cast<double>(before_.size() - 1);
  const std::int32_t* const before = before_.data();
  const Piece* const pieces = pieces_.data();
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double at = x[i];
    double interval = (at - first) * intervals_per_x;
    interval = interval > 0.0 ? interval : 0.0;  // also of NaN
    interval = interval < last_interval ? interval : last_interval;
    const Piece* piece = pieces + before[static_cast<std::int32_t>(interval)];
    piece += at >= piece->next ? 1 : 0;
    product[i] *= finiteOrNan(piece->value + (at - piece->from) * piece->slope);
  }
}

void BasisOfMany::multiply(std::span<const double> x, std::span<double> product) const {
  if (!before_.empty()) return multiplyCurve(x, product);
  double numbers[3] = {};
  std::copy_n(numbers_.begin(), std::min<std::size_t>(3, numbers_.size()), numbers);
  if (multiplyLoops(basis_, numbers, x.data(), product.data(), x.size())) return;
  for (std::size_t i = 0; i < x.size(); ++i) product[i] *= finiteOrNan(unchecked(basis_, x[i], numbers_));
}

}  // namespace toftwin::terms
