// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <toftwin/camera_info.h>
#include <toftwin/geometry.h>
#include <toftwin/image.h>

#include "sim/tracer/scene.h"

namespace toftwin::sim {

/// Which object each pixel's central ray meets first: the object's number in the scene file, counted from
/// 0, or −1 where it meets nothing. Glass counts as an object.
Image<std::int32_t> objectsSeen(const Scene& scene, const CameraInfo& camera,
                                const Transform<World, Camera>& world_from_camera);

/// If no pixel's central ray meets anything: that, and where the scene is, in words for whoever set the pose.
std::optional<std::string> seesNothing(const Scene& scene, const CameraInfo& camera,
                                       const Transform<World, Camera>& world_from_camera);

}  // namespace toftwin::sim
