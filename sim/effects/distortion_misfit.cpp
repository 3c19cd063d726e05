// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/distortion_misfit.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "sim/effects/phasors.h"

namespace toftwin::sim {
namespace {

/// Where a pixel's light comes from: the upper left of four pixels and the shares of the others.
struct Source {
  int left = 0, top = 0;
  float right_share = 0.0F, lower_share = 0.0F;
};

/// The first of the two pixels that a coordinate lies between and its distance from it; the first and the
/// last go on outwards.
std::pair<int, float> between(double at, int count) {
  const double inside = std::clamp(at, 0.0, static_cast<double>(count - 1));
  const int low = std::min(static_cast<int>(inside), std::max(0, count - 2));
  return {low, static_cast<float>(inside - low)};
}

template <class T>
void resample(const Image<T>& seen, const std::vector<Source>& row, T* out) {
  const int last_x = seen.width() - 1, last_y = seen.height() - 1;
  for (const Source& from : row) {
    const int right = std::min(from.left + 1, last_x), below = std::min(from.top + 1, last_y);
    const T a = seen(from.left, from.top), b = seen(right, from.top);
    const T c = seen(from.left, below), d = seen(right, below);
    const T upper = a + from.right_share * (b - a), lower = c + from.right_share * (d - c);
    *out++ = upper + from.lower_share * (lower - upper);
  }
}

}  // namespace

Light DistortionMisfit::apply(Light light, const Conditions& now, const Random&) const {
  if (focal_error == 0.0 && radial == 0.0 && right == 0.0 && down == 0.0) return light;
  const CameraInfo& camera = now.camera;
  const Light seen = light;
  forRows(light.height(), [&](int first_row, int last_row) {
    std::vector<Source> row(static_cast<std::size_t>(light.width()));
    for (int y = first_row; y < last_row; ++y) {
      for (int x = 0; x < light.width(); ++x) {
        const double across = (now.left + x - camera.cx) / camera.fx;
        const double up = (now.top + y - camera.cy) / camera.fy;
        const double stretch =
            (1.0 + radial * (across * across + up * up)) / (1.0 + focal_error);
        const auto [left, right_share] =
            between(across * stretch * camera.fx + camera.cx + right - now.left, light.width());
        const auto [top, lower_share] =
            between(up * stretch * camera.fy + camera.cy + down - now.top, light.height());
        row[static_cast<std::size_t>(x)] = {left, top, right_share, lower_share};
      }
      for (std::size_t i = 0; i < light.phasors.size(); ++i) {
        if (!seen.phasors[i].empty()) resample(seen.phasors[i], row, &light.phasors[i](0, y));
      }
      resample(seen.steady, row, &light.steady(0, y));
      resample(seen.ambient, row, &light.ambient(0, y));
    }
  });
  return light;
}

}  // namespace toftwin::sim
