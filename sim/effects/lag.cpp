// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/lag.h"

#include "sim/images/rows.h"

namespace toftwin::sim {
namespace {

void add(Image<float>& electrons, const Image<float>& left_behind, double share) {
  const auto factor = static_cast<float>(share);
  forRows(electrons.height(), [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      float* to = &electrons(0, y);
      const float* from = &left_behind(0, y);
      for (int x = 0; x < electrons.width(); ++x) to[x] += factor * from[x];
    }
  });
}

bool isOfTheSameKind(const Samples* before, const Samples& now) {
  return before && before->electrons.size() == now.electrons.size() &&
         before->width() == now.width() && before->height() == now.height();
}

}  // namespace

Samples Lag::apply(Samples samples, const Conditions& now, const Random&) const {
  if ((exposure_share == 0.0 && frame_share == 0.0) || samples.electrons.empty()) return samples;
  const Samples* before =
      isOfTheSameKind(now.before.collected, samples) ? now.before.collected : nullptr;
  const auto taps = static_cast<std::size_t>(samples.taps);
  // Backwards, so that each raw exposure still finds the one before it as it was collected.
  for (std::size_t i = samples.electrons.size(); i-- > 0;) {
    Image<float>& electrons = samples.electrons[i];
    const Image<float>* previous =
        i >= taps ? &samples.electrons[i - taps]
                  : before ? &before->electrons[before->electrons.size() - taps + i] : nullptr;
    if (previous && exposure_share != 0.0) add(electrons, *previous, exposure_share);
    if (before && frame_share != 0.0) add(electrons, before->electrons[i], frame_share);
  }
  return samples;
}

}  // namespace toftwin::sim
