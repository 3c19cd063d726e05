// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "calib/intrinsics/target.h"

namespace toftwin::intrinsics {

/// Corners next to a marker that was read, by index; a board need not be seen whole.
struct CharucoCorner {
  std::size_t index = 0;
  cv::Point2f at;
};
std::vector<CharucoCorner> searchCharuco(const cv::Mat& shown, const Target& target);

/// A picture of the board, so many pixels a square, to print or for tests.
cv::Mat drawCharuco(const Target& target, int square_px);

}  // namespace toftwin::intrinsics
