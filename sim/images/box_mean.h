// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <type_traits>

#include <toftwin/image.h>

namespace toftwin::sim {

/// Means over the valid pixels within `columns` and `rows` of each pixel, itself included; boxes end at the image's
/// edge. Of floats or complex floats; 0 where no pixel is valid.
template <class T>
Image<T> boxMean(const Image<T>& image, int columns, int rows) {
  constexpr bool kIsComplex = !std::is_floating_point_v<T>;
  using Sum = std::conditional_t<kIsComplex, std::complex<double>, double>;
  const auto isValid = [](const T& value) {
    if constexpr (kIsComplex)
      return std::isfinite(value.real()) && std::isfinite(value.imag());
    else
      return std::isfinite(value);
  };
  const int width = image.width(), height = image.height();
  Image<Sum> sums(width + 1, height + 1);  // of everything above and to the left
  Image<int> counts(width + 1, height + 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool is_valid = isValid(image(x, y));
      sums(x + 1, y + 1) =
          sums(x, y + 1) + sums(x + 1, y) - sums(x, y) + (is_valid ? Sum{image(x, y)} : Sum{});
      counts(x + 1, y + 1) = counts(x, y + 1) + counts(x + 1, y) - counts(x, y) + (is_valid ? 1 : 0);
    }
  }
  Image<T> mean(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int left = std::max(0, x - columns), right = std::min(width, x + columns + 1);
      const int top = std::max(0, y - rows), bottom = std::min(height, y + rows + 1);
      const auto over = [&](const auto& of) {
        return of(right, bottom) - of(left, bottom) - of(right, top) + of(left, top);
      };
      mean(x, y) = static_cast<T>(over(sums) / static_cast<double>(std::max(1, over(counts))));
    }
  }
  return mean;
}

/// Of squares.
template <class T>
Image<T> boxMean(const Image<T>& image, int reach) {
  return boxMean(image, reach, reach);
}

}  // namespace toftwin::sim
