// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/companding.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>

#include "sim/images/rows.h"
#include "sim/images/simd.h"

namespace toftwin::sim {
namespace {

/// The largest power of two not above m, for m > 0; NaN and infinity give infinity.
inline float powerBelow(float m) {
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(m) & 0x7f80'0000U);
}

/// 1/p of a power of two, exact.
inline float perPower(float p) { return std::bit_cast<float>(0x7f00'0000U - std::bit_cast<std::uint32_t>(p)); }

/// What conversion adds to a difference of charges; says whether that is too large for it.
inline float changeOf(float difference, float counts_per_electron, float electrons_per_count, bool& is_saturated) {
  const float counts = difference * counts_per_electron;
  const float magnitude = std::abs(counts), fraction = powerBelow(magnitude) * (1.0F / 128.0F);
  const float step = fraction > 1.0F ? fraction : 1.0F;
  const float code = step * std::nearbyint(magnitude * perPower(step));
  is_saturated = code > Companding::kLargest;
  const float kept = is_saturated ? Companding::kLargest : code;
  return std::copysign(kept, counts) * electrons_per_count - difference;
}

constexpr auto kSaturatedBit = static_cast<std::uint8_t>(PixelFlag::Saturated);

constexpr int kPiece = 512;  ///< of a row, whose marks stay in the nearest cache

/// Marks are as wide as the numbers that they come with, for vector code; few rows have any.
void keepMarks(const std::uint32_t* marks, int count, std::uint8_t* flags) {
  for (int x = 0; x < count; ++x) flags[x] = static_cast<std::uint8_t>(flags[x] | marks[x]);
}

/// Converts a piece of a row of two taps; says whether any was too large, and which. What conversion takes off the
/// difference goes to both alike, so that their sum stays.
TOFTWIN_SIMD bool convertTwo(float* __restrict first, float* __restrict second, int count, float counts_per_electron,
                             std::uint32_t* __restrict marks) {
  const float electrons_per_count = 1.0F / counts_per_electron;
  std::uint32_t any = 0;
  for (int x = 0; x < count; ++x) {
    bool is_saturated = false;
    const float change = changeOf(first[x] - second[x], counts_per_electron, electrons_per_count, is_saturated);
    marks[x] = is_saturated ? kSaturatedBit : 0U;
    any |= marks[x];
    first[x] += 0.5F * change;
    second[x] -= 0.5F * change;
  }
  return any != 0;
}

TOFTWIN_SIMD bool convertOne(float* __restrict first, int count, float counts_per_electron,
                             std::uint32_t* __restrict marks) {
  const float electrons_per_count = 1.0F / counts_per_electron;
  std::uint32_t any = 0;
  for (int x = 0; x < count; ++x) {
    bool is_saturated = false;
    first[x] += changeOf(first[x], counts_per_electron, electrons_per_count, is_saturated);
    marks[x] = is_saturated ? kSaturatedBit : 0U;
    any |= marks[x];
  }
  return any != 0;
}

/// Converts a row; `second` may be null.
void convertRow(float* first, float* second, int width, float counts_per_electron, std::uint8_t* flags) {
  std::uint32_t marks[kPiece];
  for (int x = 0; x < width; x += kPiece) {
    const int count = std::min(kPiece, width - x);
    const bool is_any = second != nullptr ? convertTwo(first + x, second + x, count, counts_per_electron, marks)
                                          : convertOne(first + x, count, counts_per_electron, marks);
    if (is_any) keepMarks(marks, count, flags + x);
  }
}

/// What conversion adds to a difference of charges in the mean over its noise, σ in electrons.
float meanChangeOf(float difference, double sigma, double counts_per_electron) {
  const double magnitude = std::abs(static_cast<double>(difference)) * counts_per_electron;
  const double step = std::max(1.0, static_cast<double>(powerBelow(static_cast<float>(magnitude))) / 128.0);
  const double change =
      step * meanOfRounding(magnitude / step, sigma * counts_per_electron / step) / counts_per_electron;
  return static_cast<float>(difference < 0.0F ? -change : change);
}

/// The mean over noise of one pixel's taps, in one sample. What is too large for the converter has no mean.
void convertMean(std::span<float*> taps, std::uint8_t& flags, const Companding& by) {
  const float difference = taps.size() == 2 ? *taps[0] - *taps[1] : *taps[0];
  bool is_saturated = false;
  const auto counts = static_cast<float>(by.counts_per_electron);
  float change = changeOf(difference, counts, 1.0F / counts, is_saturated);
  if (is_saturated) {
    flags = static_cast<std::uint8_t>(flags | kSaturatedBit);
  } else {
    double variance = 0.0;
    for (const float* tap : taps) variance += by.mean_over.varianceOf(static_cast<double>(*tap));
    change = meanChangeOf(difference, std::sqrt(variance), by.counts_per_electron);
  }
  const float share = taps.size() == 2 ? 0.5F : 1.0F;
  *taps[0] += share * change;
  if (taps.size() == 2) *taps[1] -= share * change;
}

}  // namespace

Samples Companding::apply(Samples samples, const Conditions&, const Random&) const {
  if (counts_per_electron <= 0.0) return samples;
  if (samples.flags.empty()) samples.flags = Image<std::uint8_t>{samples.width(), samples.height()};
  const auto taps = static_cast<std::size_t>(samples.taps);
  forRows(samples.height(), [&](int first_row, int last_row) {
    for (std::size_t i = 0; i < samples.electrons.size(); i += taps) {
      for (int y = first_row; y < last_row; ++y) {
        float* first = &samples.electrons[i](0, y);
        std::uint8_t* flags = &samples.flags(0, y);
        if (mean_over.isAny()) {
          for (int x = 0; x < samples.width(); ++x) {
            std::array<float*, 2> both{&first[x], taps == 2 ? &samples.electrons[i + 1](x, y) : nullptr};
            convertMean(std::span{both}.first(taps == 2 ? 2 : 1), flags[x], *this);
          }
          continue;
        }
        convertRow(first, taps == 2 ? &samples.electrons[i + 1](0, y) : nullptr, samples.width(),
                   static_cast<float>(counts_per_electron), flags);
      }
    }
  });
  return samples;
}

}  // namespace toftwin::sim
