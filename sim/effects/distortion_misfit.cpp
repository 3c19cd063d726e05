// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/distortion_misfit.h"

#include <algorithm>
#include <cmath>

#include "sim/effects/phasors.h"

namespace toftwin::sim {
namespace {

/// Between which pixels a coordinate lies, the first and the last going on outwards.
struct Between {
  Between(double at, int count) {
    const double inside = std::clamp(at, 0.0, static_cast<double>(count - 1));
    low = std::min(static_cast<int>(inside), std::max(0, count - 2));
    high = std::min(low + 1, count - 1);
    share = static_cast<float>(inside - low);
  }
  int low, high;
  float share;
};

}  // namespace

Light DistortionMisfit::apply(Light light, const Conditions& now, const Random&) const {
  if (focal_error == 0.0 && radial == 0.0 && right == 0.0 && down == 0.0) return light;
  const CameraInfo& camera = now.camera;
  const Light seen = light;
  forRows(light.height(), [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      for (int x = 0; x < light.width(); ++x) {
        const double across = (now.left + x - camera.cx) / camera.fx;
        const double up = (now.top + y - camera.cy) / camera.fy;
        const double stretch =
            (1.0 + radial * (across * across + up * up)) / (1.0 + focal_error);
        const Between u{across * stretch * camera.fx + camera.cx + right - now.left, light.width()};
        const Between v{up * stretch * camera.fy + camera.cy + down - now.top, light.height()};
        const auto sample = [&](const auto& image) {
          const auto above = image(u.low, v.low) + u.share * (image(u.high, v.low) - image(u.low, v.low));
          const auto below =
              image(u.low, v.high) + u.share * (image(u.high, v.high) - image(u.low, v.high));
          return above + v.share * (below - above);
        };
        for (std::size_t i = 0; i < light.phasors.size(); ++i)
          light.phasors[i](x, y) = sample(seen.phasors[i]);
        light.steady(x, y) = sample(seen.steady);
        light.ambient(x, y) = sample(seen.ambient);
      }
    }
  });
  return light;
}

}  // namespace toftwin::sim
