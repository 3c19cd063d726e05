// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned_mirror.h"

#include "sim/effects/between_pixels.h"
#include "sim/effects/phasors.h"
#include "sim/effects/squares.h"

namespace toftwin::sim {

std::string LearnedMirror::problem() const { return problemOfSquares(reaches_px, shares_percent); }

Light LearnedMirror::apply(Light light, const Conditions& now, const Random&) const {
  const double across = 2.0 * (now.camera.cx + right - now.left),
               along = 2.0 * (now.camera.cy + down - now.top);
  forEachImage(light, [&]<class T>(Image<T>& image) {
    const Image<T> source = image;
    forEachSquare(source, reaches_px, shares_percent, [&](const Image<T>& mean, float share) {
      for (int y = 0; y < image.height(); ++y)
        for (int x = 0; x < image.width(); ++x) image(x, y) += share * lightAt(mean, across - x, along - y);
    });
  });
  return light;
}

}  // namespace toftwin::sim
