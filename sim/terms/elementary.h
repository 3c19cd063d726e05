// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <toftwin/nan.h>

/// Elementary functions that compilers turn into loops of several at a time: no branch, no call. One and many give the same bits. Each is
/// within two units of the last place.
namespace toftwin::terms {

/// Inlined also where a loop is compiled for another instruction set.
#define TOFTWIN_TERMS_INLINE [[gnu::always_inline]] inline

/// sin(2π u), by the Taylor series of the quarter turn that it is folded into, whose next member is below 1e-18.
/// Turns instead of radians, so that the period is exact.
TOFTWIN_TERMS_INLINE double sineOfTurns(double turns) {
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

TOFTWIN_TERMS_INLINE double cosineOfTurns(double turns) {
  const double u = turns - std::floor(turns + 0.5);
  return sineOfTurns(0.25 - std::abs(u));
}

/// ln 2 in two parts, of which whole multiples of the first are exact.
inline constexpr double kLn2High = 0x1.62e42fefa3800p-1, kLn2Low = 0x1.ef35793c76730p-45;

/// e^x = 2^k e^r with r = x − k ln 2, |r| ≤ ½ ln 2; the Taylor series of e^r ends where its next member is below 1e-17.
/// 0 below e^−708, infinite above e^709.
TOFTWIN_TERMS_INLINE double exponential(double x) {
  constexpr double kLow = -708.0, kHigh = 709.0;
  constexpr double kWhole = 0x1.8p52;  // added to a number, it leaves the nearest whole one in the last bits
  double within = x < kLow ? kLow : x;
  within = within > kHigh ? kHigh : within;
  const double shifted = within * std::numbers::log2e + kWhole, k = shifted - kWhole;
  const double r = (within - k * kLn2High) - k * kLn2Low;
  double sum = 1.0 / 6227020800.0;  // 1/13!, then 1/12! and so on
  sum = sum * r + 1.0 / 479001600.0;
  sum = sum * r + 1.0 / 39916800.0;
  sum = sum * r + 1.0 / 3628800.0;
  sum = sum * r + 1.0 / 362880.0;
  sum = sum * r + 1.0 / 40320.0;
  sum = sum * r + 1.0 / 5040.0;
  sum = sum * r + 1.0 / 720.0;
  sum = sum * r + 1.0 / 120.0;
  sum = sum * r + 1.0 / 24.0;
  sum = sum * r + 1.0 / 6.0;
  sum = sum * r + 0.5;
  const double power = 1.0 + (r + r * r * sum);
  const double scaled = std::bit_cast<double>(std::bit_cast<std::uint64_t>(power) + (std::bit_cast<std::uint64_t>(shifted) << 52U));
  const double bounded = x < kLow ? 0.0 : scaled;
  return x > kHigh ? std::numeric_limits<double>::infinity() : (x == x ? bounded : x);
}

/// ln x = e ln 2 + ln m with x = 2^e m and √½ ≤ m < √2; ln m = 2 artanh s with s = (m − 1)/(m + 1), |s| < 0.172, by its
/// series until below 1e-18. NaN of what is not greater than 0, and of infinity.
TOFTWIN_TERMS_INLINE double naturalLogarithm(double x) {
  constexpr double kLeast = std::numeric_limits<double>::min(), kLift = 0x1p54;
  constexpr std::uint64_t kRootOfHalf = 0x3fe6a09e667f3bcd, kOne = 0x3ff0000000000000;
  const double lifted = x < kLeast ? x * kLift : x;
  const auto bits = std::bit_cast<std::uint64_t>(lifted);
  const std::uint64_t biased = (bits + (kOne - kRootOfHalf)) >> 52U;
  const double m = std::bit_cast<double>(bits - (biased << 52U) + kOne);
  // A whole number below 2^52 as the last bits of 2^52 + it.
  const double exponent = std::bit_cast<double>(biased | 0x4330000000000000) - (0x1p52 + 1023.0) - (x < kLeast ? 54.0 : 0.0);
  const double s = (m - 1.0) / (m + 1.0), s2 = s * s;
  double sum = 1.0 / 23.0;
  sum = sum * s2 + 1.0 / 21.0;
  sum = sum * s2 + 1.0 / 19.0;
  sum = sum * s2 + 1.0 / 17.0;
  sum = sum * s2 + 1.0 / 15.0;
  sum = sum * s2 + 1.0 / 13.0;
  sum = sum * s2 + 1.0 / 11.0;
  sum = sum * s2 + 1.0 / 9.0;
  sum = sum * s2 + 1.0 / 7.0;
  sum = sum * s2 + 1.0 / 5.0;
  sum = sum * s2 + 1.0 / 3.0;
  const double whole = exponent * kLn2High + (2.0 * s + (2.0 * s * s2 * sum + exponent * kLn2Low));
  const bool is_within = x > 0.0 && x < std::numeric_limits<double>::infinity();
  return is_within ? whole : kNaN;
}

}  // namespace toftwin::terms
