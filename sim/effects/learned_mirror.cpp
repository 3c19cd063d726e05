// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned_mirror.h"

#include <cmath>

#include "sim/effects/phasors.h"
#include "sim/effects/squares.h"

namespace toftwin::sim {
namespace {

/// Of an image with dark beyond its edge, linear between four pixels.
template <class T>
T lightAt(const Image<T>& image, double x, double y) {
  const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
  const auto right_share = static_cast<float>(x - left), lower_share = static_cast<float>(y - top);
  const auto at = [&](int column, int row) {
    const bool is_inside = column >= 0 && column < image.width() && row >= 0 && row < image.height();
    return is_inside ? image(column, row) : T{};
  };
  const T upper = (1.0F - right_share) * at(left, top) + right_share * at(left + 1, top);
  const T lower = (1.0F - right_share) * at(left, top + 1) + right_share * at(left + 1, top + 1);
  return (1.0F - lower_share) * upper + lower_share * lower;
}

}  // namespace

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
