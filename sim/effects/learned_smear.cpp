// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned_smear.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/effects/learned_table.h"
#include "sim/effects/neighbours.h"

namespace toftwin::sim {

Smears smearsAt(const Image<float>& range_m, int x, int y) {
  if (x == 0 || y == 0 || x + 1 == range_m.width() || y + 1 == range_m.height()) return {};
  const float left = range_m(x - 1, y), right = range_m(x + 1, y), upper = range_m(x, y - 1), lower = range_m(x, y + 1);
  const float corners = range_m(x - 1, y - 1) + range_m(x + 1, y - 1) + range_m(x - 1, y + 1) + range_m(x + 1, y + 1);
  const float around = (left + right + upper + lower + corners) / 8.0F - range_m(x, y);
  if (!std::isfinite(around)) return {};
  return {0.5F * (left - right), 0.5F * (upper - lower), around};
}

std::string LearnedSmear::problem() const {
  if (!LearnedKnots{amplitudes_e, amplitudes_e}.ascend()) return "amplitudes_e must ascend";
  for (const auto& [key, shares] : {std::pair{"across_percent", &across_percent},
                                    {"along_percent", &along_percent},
                                    {"around_percent", &around_percent}}) {
    if (shares->size() != amplitudes_e.size())
      return std::string{key} + " must have as many numbers as amplitudes_e, " + std::to_string(amplitudes_e.size());
  }
  return {};
}

RangeImage LearnedSmear::apply(RangeImage image, const Conditions&, const Random&) const {
  if (amplitudes_e.empty()) return image;
  const std::vector<double> nothing;
  const LearnedKnots knots{amplitudes_e, nothing};
  const Image<float> before = image.range_m;
  replaceRanges(image.range_m, [&](int x, int y) {
    const auto amplitude = static_cast<double>(image.amplitude(x, y));
    const Smears smears = smearsAt(before, x, y);
    const double change = knots.valueIn(across_percent, amplitude, 0.0) * static_cast<double>(smears.across) +
                          knots.valueIn(along_percent, amplitude, 0.0) * static_cast<double>(smears.along) +
                          knots.valueIn(around_percent, amplitude, 0.0) * static_cast<double>(smears.around);
    return std::isfinite(change) ? before(x, y) + static_cast<float>(1e-2 * change) : before(x, y);
  });
  return image;
}

}  // namespace toftwin::sim
