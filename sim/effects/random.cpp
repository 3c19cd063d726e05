// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/random.h"

#include <algorithm>

namespace toftwin::sim {
namespace {

/// Inversion by adding up probabilities: exact up to the 32 bits of the uniform number.
float exactPoisson(float mean, double uniform) {
  if (!(mean > 0.0F)) return 0.0F;
  double probability = std::exp(-static_cast<double>(mean));
  double below = probability;
  int count = 0;
  while (uniform > below && count < 1000) {
    ++count;
    probability *= static_cast<double>(mean) / count;
    below += probability;
  }
  return static_cast<float>(count);
}

}  // namespace

void poisson(const Random::Draw& draw, std::uint32_t first_pixel, std::span<float> means) {
  constexpr std::size_t kBlock = 256;
  float drawn[kBlock];
  for (std::size_t start = 0; start < means.size(); start += kBlock) {
    const std::span<float> block = means.subspan(start, std::min(kBlock, means.size() - start));
    const auto first = first_pixel + static_cast<std::uint32_t>(start);
    bool any_small = false;
    for (std::size_t i = 0; i < block.size(); ++i) {
      // x = λ + √λ z + (z² − 1)/6
      const float mean = block[i];
      const float z = draw.normal(first + static_cast<std::uint32_t>(i));
      const float positive = mean > 0.0F ? mean : 0.0F;
      const float x = mean + __builtin_sqrtf(positive) * z + (z * z - 1.0F) * (1.0F / 6.0F);
      // Round to nearest: adding and taking away 1.5·2²³ does, up to 2²²; larger x keep their
      // fraction, which is 1e-3 of the noise there.
      drawn[i] = x < 4194304.0F ? (x + 12582912.0F) - 12582912.0F : x;
      any_small |= mean < kPoissonExactBelow;
    }
    if (any_small) {
      for (std::size_t i = 0; i < block.size(); ++i) {
        if (block[i] < kPoissonExactBelow) {
          drawn[i] = exactPoisson(block[i], draw.uniform(first + static_cast<std::uint32_t>(i)));
        }
      }
    }
    for (std::size_t i = 0; i < block.size(); ++i) block[i] = drawn[i];
  }
}

}  // namespace toftwin::sim
