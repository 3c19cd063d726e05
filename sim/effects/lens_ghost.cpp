// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/lens_ghost.h"

#include "sim/effects/between_pixels.h"
#include "sim/effects/phasors.h"

namespace toftwin::sim {

Light LensGhost::apply(Light light, const Conditions& now, const Random&) const {
  if (share == 0.0) return light;
  const double across = 2.0 * (now.camera.cx + right - now.left), along = 2.0 * (now.camera.cy + down - now.top);
  const auto kept = static_cast<float>(1.0 - share), mirrored = static_cast<float>(share);
  forEachImage(light, [&]<class T>(Image<T>& image) {
    const Image<T> source = image;
    forRows(image.height(), [&](int first_row, int last_row) {
      for (int y = first_row; y < last_row; ++y)
        for (int x = 0; x < image.width(); ++x)
          image(x, y) = kept * source(x, y) + mirrored * lightAt(source, across - x, along - y);
    });
  });
  return light;
}

}  // namespace toftwin::sim
