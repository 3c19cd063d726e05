// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/frame.h>

#include "protocol/types/plane_of.h"

namespace toftwin::daemon {

using toftwin::planeOf;

/// x, y and z of each pixel's ray through the lens, row by row.
inline std::vector<float> unitVectorsOf(const CameraInfo& camera) {
  std::vector<float> vectors;
  vectors.reserve(3 * static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Vec3d ray = rayThroughPixel(camera, u, v).v;
      for (const double e : {ray.x, ray.y, ray.z}) vectors.push_back(static_cast<float>(e));
    }
  }
  return vectors;
}

}  // namespace toftwin::daemon
