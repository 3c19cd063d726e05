// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include <toftwin/image.h>

#include "sim/meshes/triangle_mesh.h"

namespace toftwin::sim {

/// A picture laid over a surface, repeated beyond its edges. Between pixels' centres it is bilinear.
class Texture {
 public:
  explicit Texture(Image<float> picture) : picture_(std::move(picture)) {}

  [[nodiscard]] const Image<float>& picture() const { return picture_; }
  [[nodiscard]] float at(TexturePlace place) const {
    const auto [x, fraction_x] = cellOf(place.u, picture_.width());
    const auto [y, fraction_y] = cellOf(place.v, picture_.height());
    const int right = x + 1 == picture_.width() ? 0 : x + 1, below = y + 1 == picture_.height() ? 0 : y + 1;
    const float above = picture_(x, y) + fraction_x * (picture_(right, y) - picture_(x, y));
    const float under = picture_(x, below) + fraction_x * (picture_(right, below) - picture_(x, below));
    return above + fraction_y * (under - above);
  }

 private:
  static std::pair<int, float> cellOf(float place, int size) {
    const double repeated = static_cast<double>(place) - std::floor(static_cast<double>(place));
    double pixel = repeated * size - 0.5;
    if (!(pixel >= 0.0)) pixel = std::isfinite(pixel) ? pixel + size : 0.0;
    const int cell = std::min(static_cast<int>(pixel), size - 1);
    return {cell, static_cast<float>(pixel - cell)};
  }
  Image<float> picture_;
};

/// sRGB's transfer function undone: pictures for screens store about the square root of light.
inline float linearOfSrgb(float value) {
  return value <= 0.04045f ? value / 12.92f : std::pow((value + 0.055f) / 1.055f, 2.4f);
}

}  // namespace toftwin::sim
