// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/lens_ghost.h"

#include <cmath>

#include "sim/effects/phasors.h"

namespace toftwin::sim {

Light LensGhost::apply(Light light, const Conditions& now, const Random&) const {
  if (share == 0.0) return light;
  const int across = static_cast<int>(std::lround(2.0 * (now.camera.cx + right))) - 2 * now.left;
  const int along = static_cast<int>(std::lround(2.0 * (now.camera.cy + down))) - 2 * now.top;
  const auto kept = static_cast<float>(1.0 - share), mirrored = static_cast<float>(share);
  forEachImage(light, [&](auto& image) {
    const auto source = image;
    const int width = image.width(), height = image.height();
    forRows(height, [&](int first_row, int last_row) {
      for (int y = first_row; y < last_row; ++y) {
        const int from_y = along - y;
        const bool is_inside = from_y >= 0 && from_y < height;
        for (int x = 0; x < width; ++x) {
          image(x, y) *= kept;
          const int from_x = across - x;
          if (is_inside && from_x >= 0 && from_x < width)
            image(x, y) += mirrored * source(from_x, from_y);
        }
      }
    });
  });
  return light;
}

}  // namespace toftwin::sim
