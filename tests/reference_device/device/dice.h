// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace toftwin::reference {

/// Random numbers of this device: xoshiro256++ (D. Blackman, S. Vigna, 2019), seeded by SplitMix64. One
/// stream for each key, so that the same key always gives the same numbers.
class Dice {
 public:
  explicit Dice(std::uint64_t key) {
    for (std::uint64_t& word : state_) word = mix(key += 0x9E3779B97F4A7C15U);
  }
  /// One key of several.
  static std::uint64_t key(std::uint64_t a, std::uint64_t b) {
    return mix(a ^ (mix(b) + 0x9E3779B97F4A7C15U));
  }

  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }  ///< in [0, 1)
  /// Box–Muller, both of a pair used.
  double normal() {
    if (has_spare_) return has_spare_ = false, spare_;
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform())),
                 angle = 2.0 * std::numbers::pi * uniform();
    spare_ = radius * std::sin(angle), has_spare_ = true;
    return radius * std::cos(angle);
  }
  /// Poisson: by multiplication (Knuth) below a mean of 30; above, the rounded square of a shifted normal
  /// (Anscombe), whose mean and variance are right within 1e-3 of the mean's root.
  double poisson(double mean) {
    if (!(mean > 0.0)) return 0.0;
    if (mean < 30.0) {
      const double least = std::exp(-mean);
      double product = uniform();
      int count = 0;
      for (; product > least; ++count) product *= uniform();
      return count;
    }
    const double root = std::sqrt(mean - 0.25) + 0.5 * normal();
    return std::floor(root * root + 0.5);
  }

 private:
  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31);
  }
  std::uint64_t next() {
    const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0], shifted = state_[1] << 17;
    state_[2] ^= state_[0], state_[3] ^= state_[1], state_[1] ^= state_[2], state_[0] ^= state_[3];
    state_[2] ^= shifted, state_[3] = std::rotl(state_[3], 45);
    return result;
  }
  std::uint64_t state_[4]{};
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace toftwin::reference
