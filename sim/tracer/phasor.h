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

}  // namespace toftwin::sim
