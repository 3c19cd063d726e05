// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/tracer/random.h"

namespace toftwin::sim {

/// cos and sin of 2π × turns.
struct CosSin {
  float cos, sin;
};

/// Error below 2e-7 for |turns| < 2²⁹: the whole turns are taken off in double precision, the rest is
/// a polynomial on an eighth of a turn. As a range at 16 MHz that is 0.3 µm. No branches and no
/// calls, so that loops over it become vector code.
TOFTWIN_INLINE CosSin cosSinOfTurns(double turns) {
  constexpr double kRounder = 0x1.8p52;  // adding it rounds to whole numbers
  const double quarters = (turns * 4.0 + kRounder) - kRounder;
  const auto x = static_cast<float>((turns - quarters * 0.25) * 6.283185307179586);  // in [−π/4, π/4]
  const int quadrant = static_cast<int>(quarters) & 3;
  const float x2 = x * x;
  // Taylor series; left out: x¹¹/11! < 2e-9 and x¹⁰/10! < 3e-8
  const float s = x * (1.0f + x2 * (-1.0f / 6.0f + x2 * (1.0f / 120.0f + x2 * (-1.0f / 5040.0f + x2 * (1.0f / 362880.0f)))));
  const float c = 1.0f + x2 * (-0.5f + x2 * (1.0f / 24.0f + x2 * (-1.0f / 720.0f + x2 * (1.0f / 40320.0f))));
  const bool is_odd = (quadrant & 1) != 0;
  const float cosine = is_odd ? s : c, sine = is_odd ? c : s;
  const float cosine_sign = (quadrant + 1) & 2 ? -1.0f : 1.0f, sine_sign = quadrant & 2 ? -1.0f : 1.0f;
  return {cosine * cosine_sign, sine * sine_sign};
}

/// The same in single precision throughout, for lengths that have no more: whole turns are taken off without error, and
/// so |turns| < 2²⁰ keep what they are known to.
TOFTWIN_INLINE CosSin cosSinOfTurns(float turns) {
  constexpr float kRounder = 0x1.8p23f;
  const float quarters = (turns * 4.0f + kRounder) - kRounder;
  const float x = (turns - quarters * 0.25f) * 6.28318531f;
  const int quadrant = static_cast<int>(quarters) & 3;
  const float x2 = x * x;
  const float s = x * (1.0f + x2 * (-1.0f / 6.0f + x2 * (1.0f / 120.0f + x2 * (-1.0f / 5040.0f))));
  const float c = 1.0f + x2 * (-0.5f + x2 * (1.0f / 24.0f + x2 * (-1.0f / 720.0f + x2 * (1.0f / 40320.0f))));
  const bool is_odd = (quadrant & 1) != 0;
  const float cosine = is_odd ? s : c, sine = is_odd ? c : s;
  const float cosine_sign = (quadrant + 1) & 2 ? -1.0f : 1.0f, sine_sign = quadrant & 2 ? -1.0f : 1.0f;
  return {cosine * cosine_sign, sine * sine_sign};
}

// Loops over sixteen lanes: GCC would make scalar code of them before it looks for vectors. And a copy of lanes made
// sixteen bytes at a time and read again as a whole waits for memory: numbers are changed where they lie.

/// exp(−i 2π way · turns_per_metre), in the precision that both have, and the same times `weight`.
template <class Number, class Turns>
TOFTWIN_INLINE void turnsOf(const Lanes<Number>& way, Turns turns_per_metre, const Lanes<float>& weight,
                            Lanes<float>& cosine, Lanes<float>& sine, Lanes<float>& re, Lanes<float>& im) {
#pragma GCC unroll 1
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const CosSin z = cosSinOfTurns(way[i] * turns_per_metre);
    cosine[i] = z.cos;
    sine[i] = -z.sin;
  }
#pragma GCC unroll 1
  for (std::size_t i = 0; i < kLaneCount; ++i) re[i] = weight[i] * cosine[i];
#pragma GCC unroll 1
  for (std::size_t i = 0; i < kLaneCount; ++i) im[i] = weight[i] * sine[i];
}

/// z ← z · turn, lane by lane.
TOFTWIN_INLINE void turnBy(const Lanes<float>& cosine, const Lanes<float>& sine, Lanes<float>& re, Lanes<float>& im) {
#pragma GCC unroll 1
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float a = re[i], b = im[i];
    re[i] = a * cosine[i] - b * sine[i];
    im[i] = a * sine[i] + b * cosine[i];
  }
}

/// sum += a · z, complex numbers whose parts are apart. The sum is none of the others.
TOFTWIN_INLINE void addProduct(const Lanes<float>& a_re, const Lanes<float>& a_im, const Lanes<float>& re,
                               const Lanes<float>& im, float* __restrict sum_re, float* __restrict sum_im) {
#pragma GCC unroll 1
  for (std::size_t i = 0; i < kLaneCount; ++i) sum_re[i] += a_re[i] * re[i] - a_im[i] * im[i];
#pragma GCC unroll 1
  for (std::size_t i = 0; i < kLaneCount; ++i) sum_im[i] += a_re[i] * im[i] + a_im[i] * re[i];
}

}  // namespace toftwin::sim
