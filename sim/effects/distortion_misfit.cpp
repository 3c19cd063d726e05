// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/distortion_misfit.h"

#include <utility>

#include "sim/effects/resample.h"

namespace toftwin::sim {

Light DistortionMisfit::apply(Light light, const Conditions& now, const Random&) const {
  if (focal_error == 0.0 && radial == 0.0 && right == 0.0 && down == 0.0) return light;
  const CameraInfo& camera = now.camera;
  return resampled(std::move(light), [&](int x, int y) {
    const double across = (now.left + x - camera.cx) / camera.fx;
    const double up = (now.top + y - camera.cy) / camera.fy;
    const double stretch = (1.0 + radial * (across * across + up * up)) / (1.0 + focal_error);
    return std::pair{across * stretch * camera.fx + camera.cx + right - now.left,
                     up * stretch * camera.fy + camera.cy + down - now.top};
  });
}

}  // namespace toftwin::sim
