// SPDX-License-Identifier: Apache-2.0
// In place of charuco.cpp where OpenCV came without ArUco.
#include "calib/intrinsics/charuco.h"

namespace toftwin::intrinsics {

Result<Target> charucoOf(Target, Length, const std::string&) {
  return Error{Error::Code::Unsupported,
               "this build cannot read ChArUco boards: install libopencv-contrib-dev and build again, or take a "
               "checkerboard"};
}

std::vector<CharucoCorner> searchCharuco(const cv::Mat&, const Target&) { return {}; }

cv::Mat drawCharuco(const Target&, int) { return {}; }

}  // namespace toftwin::intrinsics
