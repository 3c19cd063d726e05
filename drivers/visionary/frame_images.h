// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <toftwin/frame.h>
#include <toftwin/image.h>
#include <toftwin/result.h>

#include "drivers/visionary/wire/blob.h"
#include "drivers/visionary/wire/description.h"

namespace toftwin::drivers::visionary {

/// Where a camera's pixels look.
struct Optics {
  CameraInfo camera;
  Image<float> depth_per_range;  ///< z of each pixel's unit ray
};
/// Of its description, whose two radial terms go from pixels to rays: ours without them, fitted with them.
/// InvalidArgument: they are no camera's.
Result<Optics> opticsOf(const toftwin::visionary::Description& description);

/// Range, depth, amplitude and flags, in that order. Malformed: the images are not all there.
Result<std::vector<Plane>> planesOf(const toftwin::visionary::ReadImages& images, const Optics& optics);

}  // namespace toftwin::drivers::visionary
