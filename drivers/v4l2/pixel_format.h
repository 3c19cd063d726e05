// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <toftwin/image.h>

namespace toftwin::drivers::v4l2 {

/// How the codes of pixels lie in memory.
enum class Packing {
  Bytes,           ///< one byte each
  LittleEndian16,  ///< two bytes each, the code in the lower bits
  BigEndian16,
  Mipi10,      ///< four pixels in five bytes: their upper eight bits, then the lower two of all
  Mipi12,      ///< two pixels in three bytes: their upper eight bits, then the lower four of both
  BitStream10  ///< ten bits each, most significant first, without gaps
};

/// A format that this driver reads. [Linux kernel, userspace API, "Image Formats"]
struct PixelFormat {
  std::uint32_t fourcc;
  std::string_view name;  ///< as in keys: "Z16"
  int bits;
  Packing packing;
  bool is_depth;            ///< by its definition, not only by what a description says
  bool has_infrared_first;  ///< INZI: an image of 16-bit infrared codes, then one of depth
};

/// Those that we read, the best for depth first.
std::span<const PixelFormat> allPixelFormats();
const PixelFormat* pixelFormatOf(std::uint32_t fourcc);
const PixelFormat* pixelFormatNamed(std::string_view name);
/// "Z16 " for a fourcc, with what is not printable as "?".
std::string nameOf(std::uint32_t fourcc);

/// Bytes from one row to the next where they are tightly packed.
std::size_t tightStride(const PixelFormat& format, int width);
/// Bytes that an image takes at least: the last row need not be padded.
std::size_t leastSize(const PixelFormat& format, int width, int height, std::size_t stride);

/// The codes of one image. Empty if there are fewer than leastSize() bytes.
std::optional<Image<std::uint16_t>> unpack(const PixelFormat& format,
                                           std::span<const std::byte> bytes, int width, int height,
                                           std::size_t stride);

}  // namespace toftwin::drivers::v4l2
