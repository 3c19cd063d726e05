// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "protocol/wire/messages.h"

namespace toftwin::daemon {

/// Which part of a frame a subscription gets. Subscriptions with equal selections share one
/// encoding.
struct Selection {
  std::vector<PlaneKind> planes;  ///< in the order wanted; empty: all
  wire::Region region;            ///< width 0: the whole image
  std::uint32_t decimation = 1;
  bool operator==(const Selection&) const = default;
};

/// Whether a camera with these planes can give that selection, and if not, why.
Result<> checkSelection(const Selection& selection, const CameraInfo& camera,
                        const std::vector<PlaneKind>& planes);

/// The selected part of a frame. Whole planes are shared, not copied; a region or a decimation
/// copies. Pixel (u, v) of the result is pixel (x + n u, y + n v) of the frame, and the camera
/// follows:
///   fx' = fx / n,  cx' = (cx - x) / n
/// A plane that this frame lacks is left out. Error: the region lies outside the frame.
Result<Frame> select(const Frame& frame, const Selection& selection);

}  // namespace toftwin::daemon
