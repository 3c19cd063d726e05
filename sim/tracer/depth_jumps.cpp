// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/depth_jumps.h"

#include <algorithm>
#include <cmath>

#include "sim/images/rows.h"
#include "sim/tracer/lanes.h"

namespace toftwin::sim {
namespace {

/// Depth jumps where the inverse range bends by more than this share of itself.
constexpr float kJump = 0.02f;

/// Pixels of one row at which depth jumps.
TOFTWIN_VECTOR
void markJumps(const float* above, const float* here, const float* below, int width, unsigned char* jumps) {
  const auto inverse = [](float range) { return range > 0.0f ? 1.0f / range : 0.0f; };  // 0 for NaN
  for (int x = 1; x < width - 1; ++x) {
    const float middle = inverse(here[x]), l = inverse(here[x - 1]), r = inverse(here[x + 1]);
    const float a = inverse(above[x]), b = inverse(below[x]);
    const float across = std::abs(l + r - 2.0f * middle), down = std::abs(a + b - 2.0f * middle);
    const float most = middle > l ? (middle > r ? middle : r) : (l > r ? l : r);
    jumps[x] = (across > kJump * most) | (down > kJump * most) ? 1 : 0;
  }
}

}  // namespace

std::vector<Pixel> pixelsWithJumps(const Image<float>& range) {
  const int width = range.width(), height = range.height();
  std::vector<std::vector<Pixel>> rows(static_cast<std::size_t>(height));
  forRows(height, [&](int first, int last) {
    std::vector<unsigned char> jumps(static_cast<std::size_t>(width));
    for (int y = std::max(1, first); y < std::min(last, height - 1); ++y) {
      markJumps(&range(0, y - 1), &range(0, y), &range(0, y + 1), width, jumps.data());
      for (int x = 1; x < width - 1; ++x) {
        if (jumps[static_cast<std::size_t>(x)] != 0) rows[static_cast<std::size_t>(y)].push_back({x, y});
      }
    }
  });
  std::vector<Pixel> pixels;
  for (const auto& row : rows) pixels.insert(pixels.end(), row.begin(), row.end());
  return pixels;
}

}  // namespace toftwin::sim
