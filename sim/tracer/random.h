// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

// Inlined wherever it is called: loops over lanes become vector code only then.
#define TOFTWIN_INLINE inline __attribute__((always_inline))

namespace toftwin::sim {

/// Finaliser of SplitMix64 (Steele, Lea & Flood 2014): a bijection that decorrelates all bits.
TOFTWIN_INLINE std::uint64_t mixBits(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

inline constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15u;  // 2⁶⁴ / golden ratio

/// Names the random numbers of one pixel. Counter-based: a number depends on seed, pixel, sample and
/// dimension alone, so neither threads nor tiles nor the traced region change it.
inline std::uint64_t pixelKey(std::uint64_t seed, std::uint64_t pixel) {
  return mixBits(mixBits(seed + kGolden) + pixel);
}

TOFTWIN_INLINE std::uint32_t reverseBits(std::uint32_t x) {
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
  return (x >> 16) | (x << 16);
}

/// A random permutation in which a bit depends on the bits below it alone (the hash of Laine & Karras
/// 2011): between two reversals of the bits it is Owen's scrambling of a number's digits.
TOFTWIN_INLINE std::uint32_t scrambleUpwards(std::uint32_t x, std::uint32_t seed) {
  x += seed;
  x ^= x * 0x6c50b47cu;
  x ^= x * 0xb82f1e52u;
  x ^= x * 0xc7afe638u;
  return x ^ (x * 0x8d22f6e6u);
}

/// Two numbers in [0, 1), multiples of 2⁻³¹.
struct RandomPair {
  double u, v;
};

/// Sample `index` of a pixel in a pair of dimensions: the first two dimensions of Sobol's sequence, its
/// order shuffled and its digits scrambled after Owen (Burley 2020). The first 2ᵏ samples of a pixel
/// fill the square evenly, each by itself is uniform, and different pairs and pixels are independent.
TOFTWIN_INLINE RandomPair randomPair(std::uint64_t key, std::uint32_t index, std::uint64_t dimension) {
  const std::uint64_t seeds = mixBits(key + (2 * dimension + 1) * kGolden);
  const std::uint64_t more = mixBits(key + (2 * dimension + 2) * kGolden);
  const std::uint32_t first = scrambleUpwards(reverseBits(index), static_cast<std::uint32_t>(seeds));
  // `first` is the shuffled index reversed, which is its radical inverse. The second dimension's
  // generator is Pascal's triangle modulo 2: digit r is the parity of the index bits at supersets of r.
  const std::uint32_t shuffled = reverseBits(first);
  std::uint32_t y = shuffled;
  y ^= (y >> 1) & 0x55555555u;
  y ^= (y >> 2) & 0x33333333u;
  y ^= (y >> 4) & 0x0f0f0f0fu;
  y ^= (y >> 8) & 0x00ff00ffu;
  y ^= (y >> 16) & 0x0000ffffu;
  const std::uint32_t u = reverseBits(scrambleUpwards(shuffled, static_cast<std::uint32_t>(seeds >> 32)));
  const std::uint32_t v = reverseBits(scrambleUpwards(y, static_cast<std::uint32_t>(more)));
  return {static_cast<double>(static_cast<std::int32_t>(u >> 1)) * 0x1p-31,
          static_cast<double>(static_cast<std::int32_t>(v >> 1)) * 0x1p-31};
}

/// The same without the evenness, for less work: dimensions deep in a path gain nothing from it.
TOFTWIN_INLINE RandomPair independentPair(std::uint64_t key, std::uint32_t index, std::uint64_t dimension) {
  const std::uint64_t bits = mixBits(mixBits(key + (2 * dimension + 1) * kGolden) + index);
  return {static_cast<double>(static_cast<std::int32_t>(bits >> 33)) * 0x1p-31,
          static_cast<double>(static_cast<std::int32_t>(bits & 0x7fffffffu)) * 0x1p-31};
}

}  // namespace toftwin::sim
