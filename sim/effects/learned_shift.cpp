// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned_shift.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/effects/learned_table.h"
#include "sim/effects/resample.h"

namespace toftwin::sim {

std::string LearnedShift::problem() const {
  const std::vector<double> none;
  if (!LearnedKnots{radii_px, none}.ascend()) return "must have radii_px that ascend";
  if (radii_px.size() == outward_px.size()) return {};
  return "has " + std::to_string(outward_px.size()) + " outward_px for " + std::to_string(radii_px.size()) +
         " radii_px: one for each";
}

Light LearnedShift::apply(Light light, const Conditions& now, const Random&) const {
  if (std::ranges::all_of(outward_px, [](double shift) { return shift == 0.0; })) return light;
  const std::vector<double> none;
  const LearnedKnots knots{radii_px, none};
  return resampled(std::move(light), [&](int x, int y) {
    const double across = now.left + x - now.camera.cx, down = now.top + y - now.camera.cy;
    const double radius = std::hypot(across, down);
    const double share = radius > 0.0 ? knots.valueIn(outward_px, radius, 0.0) / radius : 0.0;
    return std::pair{x + share * across, y + share * down};
  });
}

}  // namespace toftwin::sim
