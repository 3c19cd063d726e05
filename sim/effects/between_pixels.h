// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <toftwin/image.h>

namespace toftwin::sim {

/// Of an image with dark beyond its edge, linear between four pixels; x, y: pixels.
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

}  // namespace toftwin::sim
