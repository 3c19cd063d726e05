// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor/lens_off_axis.h"

#include <fmt/format.h>

namespace toftwin::sim {

std::optional<std::string> lensOffAxis(const CameraInfo& camera) {
  const auto is_inside = [](double centre, int size) { return centre >= -0.5 && centre <= size - 0.5; };
  if (is_inside(camera.cx, camera.width) && is_inside(camera.cy, camera.height)) return std::nullopt;
  return fmt::format("the lens's axis (cx {:.6g}, cy {:.6g}) lies outside of the image of {} × {} pixels: where only the size "
                     "was changed, scale fx, fy, cx and cy as well",
                     camera.cx, camera.cy, camera.width, camera.height);
}

}  // namespace toftwin::sim
