// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/frame.h>

namespace toftwin::daemon {

/// The frame's plane of one channel and the camera's size, with all of its bytes; null where there is none.
inline const Plane* planeOf(const Frame& frame, PlaneKind kind) {
  const Plane* plane = frame.find(kind);
  return plane != nullptr && plane->channels == 1 && plane->width == frame.camera.width &&
                 plane->height == frame.camera.height && plane->data.size() == plane->byteSize()
             ? plane
             : nullptr;
}
/// The same of that type alone.
inline const Plane* planeOf(const Frame& frame, PlaneKind kind, ElementType type) {
  const Plane* plane = planeOf(frame, kind);
  return plane != nullptr && plane->type == type ? plane : nullptr;
}

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
