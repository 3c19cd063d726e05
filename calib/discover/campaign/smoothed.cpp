// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/smoothed.h"

#include <algorithm>
#include <cmath>

namespace toftwin::discover {

Image<float> smoothed(const Image<float>& image, int reach) {
  const int width = image.width(), height = image.height();
  Image<double> sums(width + 1, height + 1), counts(width + 1, height + 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto value = static_cast<double>(image(x, y));
      const bool is_there = std::isfinite(value);
      sums(x + 1, y + 1) = sums(x, y + 1) + sums(x + 1, y) - sums(x, y) + (is_there ? value : 0.0);
      counts(x + 1, y + 1) =
          counts(x, y + 1) + counts(x + 1, y) - counts(x, y) + (is_there ? 1.0 : 0.0);
    }
  }
  Image<float> mean(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int a = std::max(0, x - reach), b = std::min(width, x + reach + 1);
      const int c = std::max(0, y - reach), d = std::min(height, y + reach + 1);
      const auto over = [&](const Image<double>& of) {
        return of(b, d) - of(a, d) - of(b, c) + of(a, c);
      };
      mean(x, y) = static_cast<float>(over(sums) / std::max(1.0, over(counts)));
    }
  }
  return mean;
}

}  // namespace toftwin::discover
