// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/frame.h>

#include "sim/decode/decode.h"

namespace toftwin::drivers::kinect2 {

/// What a frame can have, in the order in which it has it.
std::span<const PlaneKind> allPlanes();

/// The planes of what was decoded, with left and right exchanged if `flip`. Gives the images away.
std::vector<Plane> planesOf(sim::RangeImage decoded, const sim::Samples& samples, const Image<float>& ray_z,
                            std::span<const PlaneKind> kinds, bool flip);

}  // namespace toftwin::drivers::kinect2
