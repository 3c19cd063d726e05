// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <string_view>
#include <vector>

namespace toftwin::pictures {

/// A PNG file of a picture of 8 or 16 bits (CV_8U, CV_16U) that is grey, or blue, green and red, or those and
/// opacity; it has pixels. A `description` (Latin-1) stands in the file as the text of that name. `effort` is
/// zlib's, 1 to 9: a Kinect's range is compressed in 4 ms with 1; with 6, in 32 ms, it is a tenth smaller.
/// W3C Portable Network Graphics, second edition, sections 5 (chunks), 9 (filters), 11.3.4.3 (text).
std::vector<std::byte> encodePng(const cv::Mat& picture, std::string_view description = {}, int effort = 1);

}  // namespace toftwin::pictures
