// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
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
  /// Of `planes`, whichever a frame has: what is set may give a source others. Else the source must have them
  /// all.
  bool those_it_has = false;
  bool operator==(const Selection&) const = default;
};

/// Bytes of each kind of plane for one pixel, as its source's last frame had them.
using PixelBytes = std::map<PlaneKind, std::uint64_t>;

/// What the planes of one frame have in all: those that the source has, for what it may come to have keeps no
/// memory from others. Of a kind not among the known: by element type and fewest channels, which is exact for
/// all but samples and phasors.
std::uint64_t bytesOf(const Selection& selection, const CameraInfo& camera,
                      const std::vector<PlaneKind>& planes, const PixelBytes& known);

/// Why a frame with so many bytes in its planes cannot be sent (TooLarge), if that is so.
Result<> checkFrameBytes(std::uint64_t bytes);

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
