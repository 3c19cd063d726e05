// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>

#include "sim/images/rough_logarithm.h"

namespace toftwin::sim {

/// Random numbers without a state: each is a hash of (seed, frame, effect, pixel, draw), so that an
/// image of noise does not depend on the number of threads or on the order of pixels.
class Random {
 public:
  /// `effect` tells effects of one model apart: its name and its place in the model.
  Random(std::uint64_t seed, std::uint64_t frame, std::uint64_t effect)
      : key_(mix(mix(mix(seed + kGolden) ^ (frame + kGolden)) ^ (effect + kGolden))) {}

  struct Two {
    float first, second;
  };

  /// The generator of one draw: all pixels of one image.
  class Draw {
   public:
    /// 32 uniform bits of a pixel. The pixel's number is spread, keyed before, between and after
    /// two rounds of multiply and shift (Wellons' low-bias constants), which GCC vectorises.
    [[nodiscard]] std::uint32_t bits(std::uint32_t pixel) const {
      std::uint32_t x = (pixel * 0x9E3779B1u) ^ key_a_;
      x = (x ^ (x >> 16)) * 0x7FEB352Du;
      x = (x ^ (x >> 15)) * 0x846CA68Bu;
      x = (x ^ (x >> 16)) + key_b_;
      x = (x ^ (x >> 16)) * 0x7FEB352Du;
      x = (x ^ (x >> 15)) * 0x846CA68Bu;
      return x ^ (x >> 16);
    }
    /// Uniform in (0, 1), of 32 bits.
    [[nodiscard]] double uniform(std::uint32_t pixel) const {
      return (static_cast<double>(bits(pixel)) + 0.5) * 0x1p-32;
    }
    /// Standard normal. Tails end at ±5.4, where the 32 bits do (a share of 6e-8 lies beyond).
    [[nodiscard]] float normal(std::uint32_t pixel) const { return normalFromBits(bits(pixel)); }
    /// Two standard normals, independent of each other and of normal(), for less than the price of one.
    [[nodiscard]] Two two(std::uint32_t pixel) const {
      const std::uint32_t first = bits(pixel);
      // One more round, keyed: the angle is as good as independent of the radius.
      std::uint32_t x = (first ^ key_b_) * 0x9E3779B1u;
      x = (x ^ (x >> 15)) * 0x7FEB352Du;
      return twoFromBits(first, x ^ (x >> 16));
    }
    /// The same, or NaN in the tails.
    [[nodiscard]] float centralNormal(std::uint32_t pixel) const { return centralNormalFromBits(bits(pixel)); }

   private:
    friend class Random;
    explicit Draw(std::uint64_t key)
        : key_a_(static_cast<std::uint32_t>(key)), key_b_(static_cast<std::uint32_t>(key >> 32)) {}
    std::uint32_t key_a_, key_b_;
  };

  [[nodiscard]] Draw draw(std::uint64_t number) const {
    return Draw{mix(key_ ^ (number + kGolden))};
  }

  /// The inverse normal distribution at the uniform number that 32 bits stand for:
  /// √2 · erf⁻¹(u), u in (−1, 1), by Giles' approximation ("Approximating the erfinv function",
  /// GPU Computing Gems 2, 2010), without branches so that it vectorises. Its distribution
  /// function is right within 3e-7, in the tails within 1e-4 of what lies beyond; see
  /// random_test.cpp.
  static float normalFromBits(std::uint32_t bits) {
    const Deviate d = deviateOf(bits);
    return 1.41421356F * d.u * (d.w < kTail ? central(d.w) : tail(d.w));
  }
  /// The same but NaN in the tails, one number in 297: half the work.
  static float centralNormalFromBits(std::uint32_t bits) {
    const Deviate d = deviateOf(bits);
    // Added, not chosen: a choice between numbers that are still to be computed would be a branch.
    return 1.41421356F * d.u * central(d.w) + (d.w < kTail ? 0.0F : std::numeric_limits<float>::quiet_NaN());
  }

  /// Box and Muller's pair, r cos φ and r sin φ with r = √(−2 ln u): radius and angle of 32 bits each. One
  /// number's distribution function is right within 1e-5 of what lies beyond; ends at 6.7.
  static Two twoFromBits(std::uint32_t radius, std::uint32_t angle) {
    const float u = (static_cast<float>(static_cast<std::int32_t>(radius >> 1)) + 0.5F) * 0x1p-31F;
    const float r = squareRoot(-2.0F * roughLogarithm(u));
    // An eighth of a turn to either side, as the lower 30 bits say. Which axis it lies along and on which side
    // of it the upper two say: sign and order, so that the whole turn is even.
    const float a = static_cast<float>(static_cast<std::int32_t>(angle << 2)) * (0x1p-31F * 0.785398163F);
    const float a2 = a * a;
    const float sine = a * (0.99999857F + a2 * (-0.16662480F + a2 * 0.00815163558F));
    const float cosine = 0.99999997F + a2 * (-0.49999857F + a2 * (0.0416550269F + a2 * -0.00135859085F));
    const float far = (angle & 0x40000000U) != 0 ? -r * cosine : r * cosine, near = r * sine;
    const bool is_across = (angle & 0x80000000U) != 0;
    return {is_across ? near : far, is_across ? far : near};
  }

  static constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15u;

  /// A bijection of 64 bits without visible structure (the finaliser of SplitMix64).
  static constexpr std::uint64_t mix(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
    return x ^ (x >> 31);
  }

 private:
  static constexpr float kTail = 5.0F;
  struct Deviate {
    float u, w;  ///< in (−1, 1), and −ln(1 − u²)
  };
  static Deviate deviateOf(std::uint32_t bits) {
    const float u = (static_cast<float>(static_cast<std::int32_t>(bits)) + 0.5F) * 0x1p-31F;
    // 1 − u² loses its digits near ±1, where the tails are: use (1 − |u|)(1 + |u|) with 1 − |u|
    // from the integer itself.
    const auto magnitude =
        static_cast<std::int32_t>(bits ^ (0U - (bits >> 31)));  // both signs alike
    const float one_minus = (static_cast<float>(0x7FFFFFFF - magnitude) + 0.5F) * 0x1p-31F;
    return {u, -logarithm(one_minus * (2.0F - one_minus))};
  }
  static float central(float w) {
    const float c = w - 2.5F;
    float sum = 2.81022636e-08F;
    sum = 3.43273939e-07F + sum * c;
    sum = -3.5233877e-06F + sum * c;
    sum = -4.39150654e-06F + sum * c;
    sum = 0.00021858087F + sum * c;
    sum = -0.00125372503F + sum * c;
    sum = -0.00417768164F + sum * c;
    sum = 0.246640727F + sum * c;
    return 1.50140941F + sum * c;
  }
  static float tail(float w) {
    const float t = squareRoot(w) - 3.0F;
    float sum = -0.000200214257F;
    sum = 0.000100950558F + sum * t;
    sum = 0.00134934322F + sum * t;
    sum = -0.00367342844F + sum * t;
    sum = 0.00573950773F + sum * t;
    sum = -0.0076224613F + sum * t;
    sum = 0.00943887047F + sum * t;
    sum = 1.00167406F + sum * t;
    return 2.83297682F + sum * t;
  }

  /// ln x for positive normal x: exponent and a polynomial of (m−1)/(m+1), m in [√½, √2). Error
  /// below 2e-7, relative to ln x or absolute, whichever is larger.
  static float logarithm(float x) {
    const auto bits = std::bit_cast<std::uint32_t>(x);
    const std::uint32_t shifted = bits - 0x3F3504F3U;  // exponent changes at √½
    const auto exponent = static_cast<float>(static_cast<std::int32_t>(shifted) >> 23);
    const float m = std::bit_cast<float>((shifted & 0x007FFFFFU) + 0x3F3504F3U);
    const float s = (m - 1.0F) / (m + 1.0F), s2 = s * s;
    const float series =
        2.0F * s * (1.0F + s2 * (1.0F / 3.0F + s2 * (0.2F + s2 * (1.0F / 7.0F + s2 / 9.0F))));
    return exponent * 0.693147181F + series;
  }
  /// √x for x ≥ 0 without the call that std::sqrt makes for errno, which would stop vectorisation.
  static float squareRoot(float x) { return __builtin_sqrtf(x); }

  std::uint64_t key_;
};

/// A key for an effect's random numbers: its name and its place in the model.
constexpr std::uint64_t effectKey(std::string_view name, std::size_t place) {
  std::uint64_t hash = 0xCBF29CE484222325u;  // FNV-1a
  for (char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3u;
  return hash + place;
}

/// Standard normals of the pixels `first_pixel`, `first_pixel` + 1, …
void fillNormals(const Random::Draw& draw, std::uint32_t first_pixel, std::span<float> normals);

/// Means from which on poisson() uses a Gaussian.
inline constexpr float kPoissonExactBelow = 32.0F;

/// Replaces each mean by a Poisson draw: exact (by inversion) below kPoissonExactBelow, from there
/// on rounded Gaussian with the third moment corrected (Cornish–Fisher), whose distribution
/// function is within 1.5e-3 of Poisson's. NaN stays; means ≤ 0 become 0. `first_pixel` numbers the
/// first mean.
void poisson(const Random::Draw& draw, std::uint32_t first_pixel, std::span<float> means);

}  // namespace toftwin::sim
