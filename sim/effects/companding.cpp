// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/companding.h"

#include <algorithm>
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

/// Converts one row; `second` is null where there is one tap. What conversion takes off the
/// difference goes to both taps alike, so that their sum stays.
TOFTWIN_SIMD void convert(float* __restrict first, float* __restrict second, std::uint8_t* __restrict flags,
                          int width, float counts_per_electron) {
  constexpr auto kSaturated = static_cast<std::uint8_t>(PixelFlag::Saturated);
  const float electrons_per_count = 1.0F / counts_per_electron;
  for (int x = 0; x < width; ++x) {
    const float difference = second == nullptr ? first[x] : first[x] - second[x];
    const float counts = difference * counts_per_electron;
    const float magnitude = std::abs(counts);
    const float step = std::max(1.0F, powerBelow(magnitude) * (1.0F / 128.0F));
    const float code = step * std::nearbyint(magnitude / step);
    const bool is_saturated = code > Companding::kLargest;
    const float kept = is_saturated ? Companding::kLargest : code;
    const float change = std::copysign(kept, counts) * electrons_per_count - difference;
    flags[x] = static_cast<std::uint8_t>(flags[x] | (is_saturated ? kSaturated : 0));
    if (second == nullptr) {
      first[x] += change;
    } else {
      first[x] += 0.5F * change;
      second[x] -= 0.5F * change;
    }
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
        convert(&samples.electrons[i](0, y), taps == 2 ? &samples.electrons[i + 1](0, y) : nullptr,
                &samples.flags(0, y), samples.width(), static_cast<float>(counts_per_electron));
      }
    }
  });
  return samples;
}

}  // namespace toftwin::sim
