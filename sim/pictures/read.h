// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>

#include <toftwin/result.h>

namespace toftwin::pictures {

/// The picture in a file of any format that OpenCV reads, as it lies there: depth and channels kept, colours
/// in the order blue, green, red. Empty where the file is not there or holds no picture that can be read. An
/// error only where OpenCV's library for picture files cannot be opened.
Result<cv::Mat> read(const std::filesystem::path& file);

}  // namespace toftwin::pictures
