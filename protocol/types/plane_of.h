// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/frame.h>

namespace toftwin {

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

}  // namespace toftwin
