// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/saturation.h"

#include "sim/images/rows.h"

namespace toftwin::sim {

Samples Saturation::apply(Samples samples, const Conditions&, const Random&) const {
  if (full_well_electrons >= kNoWell) return samples;
  const auto well = static_cast<float>(full_well_electrons);
  const auto saturated = static_cast<std::uint8_t>(PixelFlag::Saturated);
  if (samples.flags.empty()) samples.flags = Image<std::uint8_t>{samples.width(), samples.height()};
  const int width = samples.width();
  forRows(samples.height(), [&](int first_row, int last_row) {
    for (Image<float>& image : samples.electrons) {
      for (int y = first_row; y < last_row; ++y) {
        float* electrons = &image(0, y);
        std::uint8_t* flags = &samples.flags(0, y);
        for (int x = 0; x < width; ++x) {
          const bool is_full = electrons[x] > well;
          electrons[x] = is_full ? well : electrons[x];
          flags[x] = static_cast<std::uint8_t>(flags[x] | (is_full ? saturated : 0));
        }
      }
    }
  });
  return samples;
}

}  // namespace toftwin::sim
