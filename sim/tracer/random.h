// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "sim/tracer/lanes.h"

namespace toftwin::sim {

inline constexpr std::uint32_t kGolden = 0x9e3779b9u;  // 2³² / golden ratio

/// A bijection of 32 bits (Wellons' "lowbias32"). No wider multiplications: those have no vector form
/// on most processors.
TOFTWIN_INLINE std::uint32_t mixBits(std::uint32_t x) {
  x = (x ^ (x >> 16)) * 0x7feb352du;
  x = (x ^ (x >> 15)) * 0x846ca68bu;
  return x ^ (x >> 16);
}

/// Names the random numbers of one pixel. Counter-based: a number depends on seed, pixel, sample and
/// dimension alone, so neither threads nor tiles nor the traced region change it.
struct PixelKey {
  std::uint32_t a, b;
};

/// Another key, for random numbers that have nothing in common with the first one's.
TOFTWIN_INLINE PixelKey salted(PixelKey key, std::uint32_t salt) { return {mixBits(key.a ^ salt), mixBits(key.b + salt)}; }

/// The key of a request: its seed, mixed.
inline PixelKey seedKey(std::uint64_t seed) {
  const auto low = static_cast<std::uint32_t>(seed), high = static_cast<std::uint32_t>(seed >> 32);
  const std::uint32_t a = mixBits(mixBits(low + kGolden) + high);
  return {a, mixBits(mixBits(high ^ 0x5851f42du) + low + a)};
}

TOFTWIN_INLINE PixelKey pixelKey(PixelKey seed, std::uint32_t u, std::uint32_t v) {
  const std::uint32_t row = mixBits(v + seed.a);
  return {mixBits(row + u), mixBits((row ^ seed.b) + u * kGolden)};
}

/// 32 bits of a pixel's dimension.
TOFTWIN_INLINE std::uint32_t dimensionBits(PixelKey key, std::uint32_t dimension) {
  return mixBits(mixBits(dimension * kGolden ^ key.a) + key.b);
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

/// Two numbers in [0, 1), multiples of 2⁻²⁴.
struct RandomPair {
  float u, v;
};

/// The upper 24 bits, which single precision holds exactly.
TOFTWIN_INLINE float unitInterval(std::uint32_t bits) {
  return static_cast<float>(static_cast<std::int32_t>(bits >> 8)) * 0x1p-24f;
}

/// Sample `index` of a pixel in a pair of dimensions: the first two dimensions of Sobol's sequence, its
/// order shuffled and its digits scrambled after Owen (Burley 2020). The first 2ᵏ samples of a pixel
/// fill the square evenly, each by itself is uniform, and different pairs and pixels are independent.
TOFTWIN_INLINE RandomPair randomPair(PixelKey key, std::uint32_t index, std::uint32_t dimension) {
  const std::uint32_t seed = dimensionBits(key, dimension);
  const std::uint32_t first = scrambleUpwards(reverseBits(index), seed);
  // `first` is the shuffled index reversed, which is its radical inverse. The second dimension's
  // generator is Pascal's triangle modulo 2: digit r is the parity of the index bits at supersets of r.
  const std::uint32_t shuffled = reverseBits(first);
  std::uint32_t y = shuffled;
  y ^= (y >> 1) & 0x55555555u;
  y ^= (y >> 2) & 0x33333333u;
  y ^= (y >> 4) & 0x0f0f0f0fu;
  y ^= (y >> 8) & 0x00ff00ffu;
  y ^= (y >> 16) & 0x0000ffffu;
  return {unitInterval(reverseBits(scrambleUpwards(shuffled, mixBits(seed ^ 0x68e31da4u)))),
          unitInterval(reverseBits(scrambleUpwards(y, mixBits(seed ^ 0xb5297a4du))))};
}

/// The same without the evenness, for less work: dimensions deep in a path gain nothing from it.
TOFTWIN_INLINE RandomPair independentPair(PixelKey key, std::uint32_t index, std::uint32_t dimension) {
  const std::uint32_t seed = dimensionBits(key, dimension) + index * kGolden;
  const std::uint32_t u = mixBits(seed ^ 0x68e31da4u);
  return {unitInterval(u), unitInterval(mixBits(seed + 0xb5297a4du))};
}

}  // namespace toftwin::sim
