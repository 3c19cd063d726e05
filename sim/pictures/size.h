// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace toftwin::pictures {

/// The most pixels that a picture may have: 8192 × 8192. With four channels of 16 bits they take half a gigabyte.
inline constexpr std::uint64_t kMostPixels = 1ull << 26;

struct PictureSize {
  std::uint64_t width = 0, height = 0;
  [[nodiscard]] bool isWithinBound() const {
    return width > 0 && height > 0 && width <= kMostPixels && height <= kMostPixels / width;
  }
};

/// How large a PNG, JPEG, TIFF, Radiance HDR, BMP or PNM file says that it is, found before anything is decoded.
/// Nothing for other formats, and for files that end before they say it.
std::optional<PictureSize> sizeOf(std::span<const std::byte> file);

}  // namespace toftwin::pictures
