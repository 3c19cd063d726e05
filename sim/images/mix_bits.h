// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace toftwin::sim {

/// Each bit of the result hangs on all of x: Stafford's 13th mixer, as SplitMix64 ends (G. Steele, D. Lea, C. Flood,
/// OOPSLA 2014).
constexpr std::uint64_t mixBits(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31);
}

}  // namespace toftwin::sim
