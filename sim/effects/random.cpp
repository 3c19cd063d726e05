// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/random.h"

#include <algorithm>
#include <cmath>

#include "sim/images/simd.h"

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

/// x = λ + √λ z + (z² − 1)/6, rounded to a whole number, into `z`. True if a mean is so small that
/// it wants exactPoisson().
TOFTWIN_SIMD bool gaussianPoisson(const float* means, float* z, std::size_t count) {
  int small = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const float mean = means[i];
    const float positive = mean > 0.0F ? mean : 0.0F;
    const float x = mean + __builtin_sqrtf(positive) * z[i] + (z[i] * z[i] - 1.0F) * (1.0F / 6.0F);
    // Adding and taking away 1.5·2²³ rounds to nearest, up to 2²²; larger x keep their fraction,
    // which is 1e-3 of the noise there.
    const float rounded = (x + 12582912.0F) - 12582912.0F;
    z[i] = x < 4194304.0F ? rounded : x;
    small |= mean < kPoissonExactBelow ? 1 : 0;
  }
  return small != 0;
}

/// True if any is in the tails: NaN.
TOFTWIN_SIMD bool fillCentralNormals(const Random::Draw& draw, std::uint32_t first_pixel, std::uint32_t count,
                                     float* out) {
  const Random::Draw copy = draw;  // its keys in registers: no store below can change them
  int is_tail = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const float normal = copy.centralNormal(first_pixel + i);
    is_tail |= normal == normal ? 0 : 1;  // NaN
    out[i] = normal;
  }
  return is_tail != 0;
}

}  // namespace

void fillNormals(const Random::Draw& draw, std::uint32_t first_pixel, std::span<float> normals) {
  constexpr std::uint32_t kBlock = 256;
  const auto count = static_cast<std::uint32_t>(normals.size());
  for (std::uint32_t start = 0; start < count; start += kBlock) {
    float* out = &normals[start];
    const std::uint32_t in_block = std::min(kBlock, count - start), first = first_pixel + start;
    if (!fillCentralNormals(draw, first, in_block, out)) continue;
    for (std::uint32_t i = 0; i < in_block; ++i) {
      if (std::isnan(out[i])) out[i] = draw.normal(first + i);
    }
  }
}

void poisson(const Random::Draw& draw, std::uint32_t first_pixel, std::span<float> means) {
  constexpr std::size_t kBlock = 512;
  float drawn[kBlock];
  for (std::size_t start = 0; start < means.size(); start += kBlock) {
    const std::span<float> block = means.subspan(start, std::min(kBlock, means.size() - start));
    const auto first = first_pixel + static_cast<std::uint32_t>(start);
    fillNormals(draw, first, {drawn, block.size()});
    if (gaussianPoisson(block.data(), drawn, block.size())) {
      for (std::size_t i = 0; i < block.size(); ++i) {
        if (block[i] < kPoissonExactBelow) {
          drawn[i] = exactPoisson(block[i], draw.uniform(first + static_cast<std::uint32_t>(i)));
        }
      }
    }
    std::copy_n(drawn, block.size(), block.begin());
  }
}

}  // namespace toftwin::sim
