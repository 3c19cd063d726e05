// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/saturation.h"

#include "sim/images/rows.h"
#include "sim/images/simd.h"

namespace toftwin::sim {
namespace {

TOFTWIN_SIMD void cut(float* __restrict electrons, std::uint8_t* __restrict flags, int width, float well) {
  constexpr auto kFull = static_cast<std::uint8_t>(PixelFlag::Saturated);
  for (int x = 0; x < width; ++x) {
    const bool is_full = electrons[x] > well;
    electrons[x] = is_full ? well : electrons[x];
    flags[x] = static_cast<std::uint8_t>(flags[x] | (is_full ? kFull : 0));
  }
}

}  // namespace

Samples Saturation::apply(Samples samples, const Conditions&, const Random&) const {
  if (full_well_electrons >= kNoWell) return samples;
  const auto well = static_cast<float>(full_well_electrons);
  if (samples.flags.empty()) samples.flags = Image<std::uint8_t>{samples.width(), samples.height()};
  const int width = samples.width();
  forRows(samples.height(), [&](int first_row, int last_row) {
    for (Image<float>& image : samples.electrons) {
      for (int y = first_row; y < last_row; ++y) {
        cut(&image(0, y), &samples.flags(0, y), width, well);
      }
    }
  });
  return samples;
}

}  // namespace toftwin::sim
