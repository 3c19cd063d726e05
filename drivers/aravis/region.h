// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/camera_info.h>
#include <toftwin/result.h>

#include "drivers/lens.h"

/// A camera that sends a part of its image, and the lens of that part.
namespace toftwin::drivers::aravis {

/// One side of the whole image, binned as now. 0: the camera does not say.
struct WholeSide {
  int pixels = 0;
  int otherwise = 0;  ///< where the camera leaves two readings open
  [[nodiscard]] bool is(int side) const { return side == pixels || side == otherwise; }
};
/// `sensor`: SensorWidth by binning and decimation. `most`: WidthMax, which is what a region may have at all,
/// of some cameras from `offset` on. The sensor says which, unless it has a border that is never sent, or
/// pixels that are binned without a word. 0: not said.
WholeSide wholeSide(int sensor, int most, int offset, int sent);

/// Which part of its image a camera sends, in pixels as they are sent (binned).
struct Region {
  int x = 0, y = 0, width = 0, height = 0;
  WholeSide whole_width{}, whole_height{};
  bool skips_pixels = false;  ///< decimation: neither cut off nor binned
};

/// The lens of the region, from one of the whole image or of this very region; of another size, if it is
/// scaled by binning alone. Incompatible if which of the lens's pixels are sent cannot be told.
Result<Lens> lensOfRegion(const LensKeys& lens, const Region& region);
Result<Lens> lensOfRegion(const CameraInfo& calibrated, const Region& region);

}  // namespace toftwin::drivers::aravis
