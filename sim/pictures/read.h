// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>

#include <toftwin/result.h>

namespace toftwin::pictures {

/// The picture in a PNG, JPEG, TIFF, Radiance HDR, BMP or PNM file, as it lies there: depth and channels kept,
/// colours in the order blue, green, red. Empty where the file is not there or holds no picture that can be read.
/// An error where the picture has too many pixels (size.h), or OpenCV's library for pictures cannot be opened.
Result<cv::Mat> read(const std::filesystem::path& file);

/// The same of a file's bytes; `name` stands for it in errors.
Result<cv::Mat> decode(std::span<const std::byte> bytes, const std::string& name);

}  // namespace toftwin::pictures
