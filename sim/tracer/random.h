// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <utility>

namespace toftwin::sim {

/// Finaliser of SplitMix64 (Steele, Lea & Flood 2014): a bijection that decorrelates all bits.
inline std::uint64_t mixBits(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// The random numbers of one path. Counter-based: a number depends on seed, pixel, sample and
/// dimension alone, so neither threads nor tiles nor the traced region change it.
class PathRandom {
 public:
  PathRandom() = default;
  PathRandom(std::uint64_t seed, std::uint64_t pixel, std::uint64_t sample)
      : key_(mixBits(mixBits(mixBits(seed + kStep) + pixel) + sample)) {}

  /// Two independent numbers in [0, 1) for a dimension.
  [[nodiscard]] std::pair<double, double> pair(std::uint64_t dimension) const {
    const std::uint64_t bits = mixBits(key_ + (dimension + 1) * kStep);
    return {static_cast<double>(bits >> 32) * 0x1p-32, static_cast<double>(bits & 0xffffffffu) * 0x1p-32};
  }

 private:
  static constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15u;  // 2⁶⁴ / golden ratio
  std::uint64_t key_ = 0;
};

}  // namespace toftwin::sim
