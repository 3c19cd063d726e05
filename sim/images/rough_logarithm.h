// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>

namespace toftwin::sim {

/// ln x for positive normal x, without a quotient or a branch, so that loops of it become vector code: exponent and a
/// polynomial of m − 1, m in [√½, √2), of the least largest error, 2e-6 of ln x or absolute, whichever is larger.
inline float roughLogarithm(float x) {
  const std::uint32_t shifted = std::bit_cast<std::uint32_t>(x) - 0x3F3504F3U;  // exponent changes at √½
  const auto exponent = static_cast<float>(static_cast<std::int32_t>(shifted) >> 23);
  const float f = std::bit_cast<float>((shifted & 0x007FFFFFU) + 0x3F3504F3U) - 1.0F;
  float sum = -0.14337535F;
  sum = 0.22314669F + sum * f;
  sum = -0.25464324F + sum * f;
  sum = 0.33228027F + sum * f;
  sum = -0.49985583F + sum * f;
  sum = 1.000012F + sum * f;
  return exponent * 0.693147181F + f * sum;
}

}  // namespace toftwin::sim
