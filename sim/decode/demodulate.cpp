// SPDX-License-Identifier: Apache-2.0
#include "sim/decode/demodulate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "sim/images/simd.h"

namespace toftwin::sim {
namespace {

const float* tapRow(const Samples& samples, std::size_t frequency, int step, int tap, int y) {
  return &samples.tap(frequency, step, tap)(0, y);
}

TOFTWIN_SIMD void addOne(const float* __restrict a, float weight, int width, float* __restrict sum) {
  for (int x = 0; x < width; ++x) sum[x] += weight * a[x];
}

TOFTWIN_SIMD void addDifference(const float* __restrict a, const float* __restrict b, float weight, int width,
                                float* __restrict sum) {
  for (int x = 0; x < width; ++x) sum[x] += weight * (a[x] - b[x]);
}

/// sum[x] += weight · sample[x] for one step of one frequency.
void addSample(const Samples& samples, std::size_t frequency, int step, int y, float weight, float* sum) {
  const float* a = tapRow(samples, frequency, step, 0, y);
  if (samples.taps == 1) {
    addOne(a, weight, samples.width(), sum);
  } else {
    addDifference(a, tapRow(samples, frequency, step, 1, y), weight, samples.width(), sum);
  }
}

/// So many pixels at a time, in room that stays in cache.
constexpr int kPiece = 256;

/// Adds a sample's part of both components of the phasors of at most kPiece pixels; `b` may be null.
TOFTWIN_SIMD void addToBoth(const float* __restrict a, const float* __restrict b, float cosine, float sine, int count,
                            float* __restrict real, float* __restrict imaginary) {
  for (int x = 0; x < count; ++x) {
    const float sample = b != nullptr ? a[x] - b[x] : a[x];
    real[x] += cosine * sample;
    imaginary[x] += sine * sample;
  }
}

TOFTWIN_SIMD void interleave(const float* __restrict real, const float* __restrict imaginary, int count,
                             float* __restrict parts) {
  for (int x = 0; x < count; ++x) {
    parts[2 * x] = real[x];
    parts[2 * x + 1] = imaginary[x];
  }
}

}  // namespace

Steps::Steps(int count) {
  for (int k = 0; k < count; ++k) {
    const double theta = 2.0 * std::numbers::pi * k / count;
    cosine.push_back(static_cast<float>(std::cos(theta)));
    sine.push_back(static_cast<float>(std::sin(theta)));
  }
}

void demodulateRow(const Samples& samples, const Steps& steps, std::size_t frequency, int y,
                   std::complex<float>* phasors) {
  const float scale = 2.0F / static_cast<float>(samples.steps);
  for (int first = 0; first < samples.width(); first += kPiece) {
    const int count = std::min(kPiece, samples.width() - first);
    std::array<float, kPiece> real{}, imaginary{};
    for (int k = 0; k < samples.steps; ++k) {
      const auto at = static_cast<std::size_t>(k);
      const float* b = samples.taps == 1 ? nullptr : tapRow(samples, frequency, k, 1, y) + first;
      addToBoth(tapRow(samples, frequency, k, 0, y) + first, b, scale * steps.cosine[at], -scale * steps.sine[at], count,
                real.data(), imaginary.data());
    }
    interleave(real.data(), imaginary.data(), count, reinterpret_cast<float*>(phasors + first));
  }
}

TOFTWIN_SIMD void polarRow(const std::complex<float>* phasors, std::size_t count, float zero_cycles,
                           float* cycles, float* amplitudes) {
  const auto* parts = reinterpret_cast<const float*>(phasors);
  for (std::size_t x = 0; x < count; ++x) {
    const float real = parts[2 * x], imaginary = -parts[2 * x + 1];
    const float across = std::abs(real), up = std::abs(imaginary);
    const float longer = across > up ? across : up, shorter = across > up ? up : across;
    const float t = longer > 0.0F ? shorter / longer : 0.0F * longer;  // NaN stays NaN
    const float t2 = t * t;
    float series = 0.0028662257F;
    series = -0.0161657367F + series * t2;
    series = 0.0429096138F + series * t2;
    series = -0.0752896400F + series * t2;
    series = 0.1065626393F + series * t2;
    series = -0.1420889944F + series * t2;
    series = 0.1999355085F + series * t2;
    series = -0.3333314528F + series * t2;
    const float eighth = (t + t * t2 * series) * 0.159154943F;  // atan(t) / 2π, 0 … 1/8
    const float quarter = across > up ? eighth : 0.25F - eighth;
    const float half = real < 0.0F ? 0.5F - quarter : quarter;
    const float turn = (imaginary < 0.0F ? 1.0F - half : half) - zero_cycles;
    const float from_zero = turn < 0.0F ? turn + 1.0F : turn;
    cycles[x] = from_zero >= 1.0F ? from_zero - 1.0F : from_zero;
    amplitudes[x] = __builtin_sqrtf(real * real + imaginary * imaginary);
  }
}

void unmodulatedRow(const Samples& samples, int y, float* charge) {
  const int width = samples.width();
  std::fill_n(charge, width, 0.0F);
  const auto exposures = samples.electrons.size() / static_cast<std::size_t>(samples.taps);
  const float scale = 1.0F / static_cast<float>(exposures);
  for (const Image<float>& image : samples.electrons) addOne(&image(0, y), scale, width, charge);
}

void asymmetryRow(const Samples& samples, int y, float* electrons) {
  const auto width = static_cast<std::size_t>(samples.width());
  std::fill_n(electrons, width, 0.0F);
  std::vector<float> sum(width);
  const float scale = 2.0F / static_cast<float>(samples.steps);
  const auto takeLargest = [&] {
    for (std::size_t x = 0; x < width; ++x) electrons[x] = std::max(electrons[x], std::abs(sum[x]));
    std::fill(sum.begin(), sum.end(), 0.0F);
  };
  for (std::size_t f = 0; f < samples.frequencies.size(); ++f) {
    if (samples.steps % 2 == 0) {
      for (int k = 0; k < samples.steps; ++k) {
        addSample(samples, f, k, y, k % 2 == 0 ? scale : -scale, sum.data());
      }
      takeLargest();
    }
    if (samples.taps == 2) {
      for (int k = 0; k < samples.steps; ++k) addSample(samples, f, k, y, scale, sum.data());
      takeLargest();
    }
  }
}

}  // namespace toftwin::sim
