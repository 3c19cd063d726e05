// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::pictures {

/// A picture as a JPEG file: `planes` are red, green and blue, one image after the other, row by row. Quality 1 to
/// 100. InvalidArgument: the planes are not three of that size; Unsupported: OpenCV's library for pictures cannot be
/// opened.
Result<std::vector<std::byte>> encodeJpeg(std::span<const std::uint8_t> planes, int width, int height, int quality);

}  // namespace toftwin::pictures
