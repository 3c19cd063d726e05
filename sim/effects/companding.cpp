// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/companding.h"

#include <bit>
#include <cmath>

#include "sim/images/rows.h"
#include "sim/images/simd.h"

namespace toftwin::sim {
namespace {

/// The largest power of two not above m, for m > 0; NaN and infinity give infinity.
inline float powerBelow(float m) {
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(m) & 0x7f80'0000U);
}

/// What conversion adds to a difference of charges; says whether that is too large for it.
inline float changeOf(float difference, float counts_per_electron, float electrons_per_count, bool& is_saturated) {
  const float counts = difference * counts_per_electron;
  const float magnitude = std::abs(counts), fraction = powerBelow(magnitude) * (1.0F / 128.0F);
  const float step = fraction > 1.0F ? fraction : 1.0F;
  const float code = step * std::nearbyint(magnitude / step);
  is_saturated = code > Companding::kLargest;
  const float kept = is_saturated ? Companding::kLargest : code;
  return std::copysign(kept, counts) * electrons_per_count - difference;
}

constexpr auto kSaturatedBit = static_cast<std::uint8_t>(PixelFlag::Saturated);

/// Converts one row of two taps. What conversion takes off the difference goes to both alike, so that
/// their sum stays.
TOFTWIN_SIMD void convertTwo(float* __restrict first, float* __restrict second, std::uint8_t* __restrict flags,
                             int width, float counts_per_electron) {
  const float electrons_per_count = 1.0F / counts_per_electron;
  for (int x = 0; x < width; ++x) {
    bool is_saturated = false;
    const float change = changeOf(first[x] - second[x], counts_per_electron, electrons_per_count, is_saturated);
    flags[x] = static_cast<std::uint8_t>(flags[x] | (is_saturated ? kSaturatedBit : 0));
    first[x] += 0.5F * change;
    second[x] -= 0.5F * change;
  }
}

TOFTWIN_SIMD void convertOne(float* __restrict first, std::uint8_t* __restrict flags, int width,
                             float counts_per_electron) {
  const float electrons_per_count = 1.0F / counts_per_electron;
  for (int x = 0; x < width; ++x) {
    bool is_saturated = false;
    first[x] += changeOf(first[x], counts_per_electron, electrons_per_count, is_saturated);
    flags[x] = static_cast<std::uint8_t>(flags[x] | (is_saturated ? kSaturatedBit : 0));
  }
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
        const auto scale = static_cast<float>(counts_per_electron);
        if (taps == 2) {
          convertTwo(first, &samples.electrons[i + 1](0, y), flags, samples.width(), scale);
        } else {
          convertOne(first, flags, samples.width(), scale);
        }
      }
    }
  });
  return samples;
}

}  // namespace toftwin::sim
