// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "drivers/visionary/wire/blob.h"
#include "drivers/visionary/wire/description.h"

namespace toftwin::daemon::visionary {

/// What the camera's description says of a lens. Its clients know two radial terms, from pixels to rays:
///   (x, y) = c (1 + k1 r² + k2 r⁴),  c = ((cx - column) / fx, (cy - row) / fy)
/// which are fitted to the lens; what else it bends is left.
toftwin::visionary::Description descriptionOf(const CameraInfo& camera);

/// A frame as the camera sends it; `wire` refers to the images beside it.
struct CameraImages {
  std::vector<std::uint16_t> distance{}, intensity{}, state{};
  toftwin::visionary::BlobImages wire{};
};

/// The camera's unit conversion (docs/facades/visionary.md):
///   distance = round(4 · range / mm), 0 where there is none or beyond 16.38 m
///   intensity = round(amplitude / amplitude_per_count), at most 65,535
///   state: the flags, bit by bit, as they are here
/// With `masks` pixels whose flags say Invalid are 0. Unsupported: the frame has neither range nor depth.
Result<CameraImages> imagesOf(const Frame& frame, double amplitude_per_count, bool masks);

}  // namespace toftwin::daemon::visionary
