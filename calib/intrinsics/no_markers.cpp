// SPDX-License-Identifier: Apache-2.0
// In place of markers.cpp where OpenCV came without ArUco.
#include "calib/intrinsics/markers.h"

namespace toftwin::intrinsics {

Result<Markers> markersOf(const std::string&, int) {
  return Error{Error::Code::Unsupported,
               "this build cannot read markers: install libopencv-contrib-dev and build again, or take a "
               "checkerboard"};
}

std::vector<MarkerCorner> searchMarkers(const cv::Mat&, const Target&) { return {}; }

cv::Mat drawMarkers(const Target&, int) { return {}; }

}  // namespace toftwin::intrinsics
