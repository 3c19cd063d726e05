// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "sim/effects/phasors.h"

/// Light from another place of the image.
namespace toftwin::sim {

/// Where a pixel's light comes from: the upper left of four pixels and the shares of the others.
struct ResampledFrom {
  int left = 0, top = 0;
  float right_share = 0.0F, lower_share = 0.0F;
};

/// The first of the two pixels that a coordinate lies between and its distance from it; the first and the
/// last go on outwards.
inline std::pair<int, float> betweenPixels(double at, int count) {
  const double inside = std::clamp(at, 0.0, static_cast<double>(count - 1));
  const int low = std::min(static_cast<int>(inside), std::max(0, count - 2));
  return {low, static_cast<float>(inside - low)};
}

template <class T>
void resampleRow(const Image<T>& seen, const std::vector<ResampledFrom>& row, T* out) {
  const int last_x = seen.width() - 1, last_y = seen.height() - 1;
  for (const ResampledFrom& from : row) {
    const int right = std::min(from.left + 1, last_x), below = std::min(from.top + 1, last_y);
    const T a = seen(from.left, from.top), b = seen(right, from.top);
    const T c = seen(from.left, below), d = seen(right, below);
    const T upper = a + from.right_share * (b - a), lower = c + from.right_share * (d - c);
    *out++ = upper + from.lower_share * (lower - upper);
  }
}

/// Each pixel (x, y) with the light of place(x, y), a pair of coordinates in the same image, interpolated
/// between four pixels; the first and the last go on outwards.
template <class Place>
Light resampled(Light light, const Place& place) {
  const Light seen = light;
  forRows(light.height(), [&](int first_row, int last_row) {
    std::vector<ResampledFrom> row(static_cast<std::size_t>(light.width()));
    for (int y = first_row; y < last_row; ++y) {
      for (int x = 0; x < light.width(); ++x) {
        const auto [across, down] = place(x, y);
        const auto [left, right_share] = betweenPixels(across, light.width());
        const auto [top, lower_share] = betweenPixels(down, light.height());
        row[static_cast<std::size_t>(x)] = {left, top, right_share, lower_share};
      }
      for (std::size_t i = 0; i < light.phasors.size(); ++i) {
        if (!seen.phasors[i].empty()) resampleRow(seen.phasors[i], row, &light.phasors[i](0, y));
      }
      resampleRow(seen.steady, row, &light.steady(0, y));
      resampleRow(seen.ambient, row, &light.ambient(0, y));
    }
  });
  return light;
}

}  // namespace toftwin::sim
