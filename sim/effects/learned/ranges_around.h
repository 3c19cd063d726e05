// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <toftwin/image.h>

namespace toftwin::sim {

/// What the ranges about a pixel are farther than itself, in metres: half of the left one's less the right one's, half of the
/// upper one's less the lower one's, and the mean of all eight less its own.
struct Smears {
  float across = 0.0F, along = 0.0F, around = 0.0F;
};

/// At (x, y). All 0 at the image's edge and beside a range that is NaN.
inline Smears smearsAt(const Image<float>& range_m, int x, int y) {
  if (x == 0 || y == 0 || x + 1 == range_m.width() || y + 1 == range_m.height()) return {};
  const float left = range_m(x - 1, y), right = range_m(x + 1, y), upper = range_m(x, y - 1), lower = range_m(x, y + 1);
  const float corners = range_m(x - 1, y - 1) + range_m(x + 1, y - 1) + range_m(x - 1, y + 1) + range_m(x + 1, y + 1);
  const float around = (left + right + upper + lower + corners) / 8.0F - range_m(x, y);
  if (!std::isfinite(around)) return {};
  return {0.5F * (left - right), 0.5F * (upper - lower), around};
}

}  // namespace toftwin::sim
