// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <toftwin/camera_info.h>
#include <toftwin/geometry.h>
#include <toftwin/image.h>

#include "sim/tracer/scene.h"

namespace toftwin::sim {

/// Which object each pixel's central ray meets first: the object's number in the scene file, counted from
/// 0, or −1 where it meets nothing. Glass counts as an object.
Image<std::int32_t> objectsSeen(const Scene& scene, const CameraInfo& camera,
                                const Transform<World, Camera>& world_from_camera);

}  // namespace toftwin::sim
