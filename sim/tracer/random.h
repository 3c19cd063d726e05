// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace toftwin::sim {

/// Finaliser of SplitMix64 (Steele, Lea & Flood 2014): a bijection that decorrelates all bits.
inline __attribute__((always_inline)) std::uint64_t mixBits(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// The random numbers of one path come from its key. Counter-based: a number depends on seed, pixel,
/// sample and dimension alone, so neither threads nor tiles nor the traced region change it.
inline std::uint64_t pathKey(std::uint64_t seed, std::uint64_t pixel, std::uint64_t sample) {
  constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15u;  // 2⁶⁴ / golden ratio
  return mixBits(mixBits(mixBits(seed + kGolden) + pixel) + sample);
}

/// Two independent numbers in [0, 1), multiples of 2⁻³¹.
struct RandomPair {
  double u, v;
};
inline __attribute__((always_inline)) RandomPair randomPair(std::uint64_t key, std::uint64_t dimension) {
  constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15u;
  const std::uint64_t bits = mixBits(key + (dimension + 1) * kGolden);
  return {static_cast<double>(static_cast<std::int32_t>(bits >> 33)) * 0x1p-31,
          static_cast<double>(static_cast<std::int32_t>(bits & 0x7fffffffu)) * 0x1p-31};
}

}  // namespace toftwin::sim
