// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include <toftwin/result.h>

#include "calib/intrinsics/dictionary.h"
#include "calib/intrinsics/target.h"

namespace toftwin::intrinsics {

/// A corner of the board that a marker told, by index; a board need not be seen whole.
struct MarkerCorner {
  std::size_t index = 0;
  cv::Point2f at;
};
/// Of a ChArUco board or a grid of tags; in the order of the index.
std::vector<MarkerCorner> searchMarkers(const cv::Mat& shown, const Target& target);

/// A picture of a board with markers, so many pixels a square, or from one tag to the next; to print or for
/// tests. Tags have half a gap of white around them.
cv::Mat drawMarkers(const Target& target, int square_px);

}  // namespace toftwin::intrinsics
