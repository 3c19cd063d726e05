// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/column_comb.h"

#include <vector>

#include "sim/effects/column_change.h"

namespace toftwin::sim {

Samples ColumnComb::apply(Samples samples, const Conditions& now, const Random&) const {
  if (offset_electrons == 0.0 && gain == 0.0) return samples;
  // Keyed by the device alone: the pattern must be the same in every frame and for every seed.
  const Random pattern{device, 0, effectKey(about.name, 0)};
  const auto width = static_cast<std::size_t>(samples.width());
  std::vector<float> factor(width), offset(width);
  const auto classOf = [&](std::size_t x) {
    return static_cast<std::uint32_t>((now.left + static_cast<int>(x)) % period);
  };
  for (std::size_t x = 0; x < width; ++x)
    factor[x] = 1.0F + static_cast<float>(gain) * pattern.draw(0).normal(classOf(x));
  for (std::size_t i = 0; i < samples.electrons.size(); ++i) {
    const Random::Draw draw = pattern.draw(i + 1);
    for (std::size_t x = 0; x < width; ++x)
      offset[x] = static_cast<float>(offset_electrons) * draw.normal(classOf(x));
    changeColumns(samples.electrons[i], factor, offset);
  }
  return samples;
}

}  // namespace toftwin::sim
