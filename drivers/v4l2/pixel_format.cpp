// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/pixel_format.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>

namespace toftwin::drivers::v4l2 {
namespace {

constexpr std::uint32_t kY12P = v4l2_fourcc('Y', '1', '2', 'P');  // younger than some headers

constexpr std::array kFormats{
    PixelFormat{V4L2_PIX_FMT_Z16, "Z16", 16, Packing::LittleEndian16, true, false},
    PixelFormat{V4L2_PIX_FMT_INZI, "INZI", 16, Packing::LittleEndian16, true, true},
    PixelFormat{V4L2_PIX_FMT_Y16, "Y16", 16, Packing::LittleEndian16, false, false},
    PixelFormat{V4L2_PIX_FMT_Y16_BE, "Y16_BE", 16, Packing::BigEndian16, false, false},
    PixelFormat{V4L2_PIX_FMT_Y12, "Y12", 12, Packing::LittleEndian16, false, false},
    PixelFormat{kY12P, "Y12P", 12, Packing::Mipi12, false, false},
    PixelFormat{V4L2_PIX_FMT_Y10, "Y10", 10, Packing::LittleEndian16, false, false},
    PixelFormat{V4L2_PIX_FMT_Y10P, "Y10P", 10, Packing::Mipi10, false, false},
    PixelFormat{V4L2_PIX_FMT_Y10BPACK, "Y10B", 10, Packing::BitStream10, false, false},
    PixelFormat{V4L2_PIX_FMT_GREY, "Y8", 8, Packing::Bytes, false, false},
};

unsigned at(const std::byte* row, std::size_t i) { return std::to_integer<unsigned>(row[i]); }

/// Pixel x of a row.
template <Packing kPacking>
unsigned codeAt(const std::byte* row, std::size_t x) {
  if constexpr (kPacking == Packing::Bytes) return at(row, x);
  if constexpr (kPacking == Packing::LittleEndian16)
    return at(row, 2 * x) | at(row, 2 * x + 1) << 8U;
  if constexpr (kPacking == Packing::BigEndian16) return at(row, 2 * x) << 8U | at(row, 2 * x + 1);
  if constexpr (kPacking == Packing::Mipi10) {
    const std::byte* group = row + x / 4 * 5;
    return at(group, x % 4) << 2U | (at(group, 4) >> (2 * (x % 4)) & 3U);
  }
  if constexpr (kPacking == Packing::Mipi12) {
    const std::byte* group = row + x / 2 * 3;
    return at(group, x % 2) << 4U | (at(group, 2) >> (4 * (x % 2)) & 15U);
  }
  if constexpr (kPacking == Packing::BitStream10) {
    const std::size_t bit = 10 * x;
    const unsigned both = at(row, bit / 8) << 8U | at(row, bit / 8 + 1);
    return both >> (6 - bit % 8) & 0x3FFU;
  }
}

template <Packing kPacking>
void unpackRows(std::span<const std::byte> bytes, std::size_t stride, unsigned mask,
                Image<std::uint16_t>& image) {
  std::uint16_t* out = image.pixels().data();
  for (int y = 0; y < image.height(); ++y) {
    const std::byte* row = bytes.data() + static_cast<std::size_t>(y) * stride;
    for (std::size_t x = 0; x < static_cast<std::size_t>(image.width()); ++x) {
      *out++ = static_cast<std::uint16_t>(codeAt<kPacking>(row, x) & mask);
    }
  }
}

}  // namespace

std::span<const PixelFormat> allPixelFormats() { return kFormats; }

const PixelFormat* pixelFormatOf(std::uint32_t fourcc) {
  const auto found = std::ranges::find(kFormats, fourcc, &PixelFormat::fourcc);
  return found == kFormats.end() ? nullptr : &*found;
}

const PixelFormat* pixelFormatNamed(std::string_view name) {
  const auto found = std::ranges::find(kFormats, name, &PixelFormat::name);
  return found == kFormats.end() ? nullptr : &*found;
}

std::string nameOf(std::uint32_t fourcc) {
  std::string name;
  for (unsigned shift = 0; shift < 32; shift += 8) {
    const char c = static_cast<char>(fourcc >> shift & 0x7FU);
    name += c >= ' ' && c <= '~' ? c : '?';
  }
  return name;
}

std::size_t tightStride(const PixelFormat& format, int width) {
  const auto pixels = static_cast<std::size_t>(width);
  switch (format.packing) {
    case Packing::Bytes:
      return pixels;
    case Packing::LittleEndian16:
    case Packing::BigEndian16:
      return 2 * pixels;
    case Packing::Mipi10:
      return (pixels + 3) / 4 * 5;
    case Packing::Mipi12:
      return (pixels + 1) / 2 * 3;
    case Packing::BitStream10:
      return (10 * pixels + 7) / 8;
  }
  return 0;
}

std::size_t leastSize(const PixelFormat& format, int width, int height, std::size_t stride) {
  const std::size_t tight = tightStride(format, width);
  const std::size_t rows = static_cast<std::size_t>(height) * (format.has_infrared_first ? 2 : 1);
  return (rows - 1) * std::max(stride, tight) + tight;
}

std::optional<Image<std::uint16_t>> unpack(const PixelFormat& format,
                                           std::span<const std::byte> bytes, int width, int height,
                                           std::size_t stride) {
  const std::size_t tight = tightStride(format, width);
  const std::size_t step = std::max(stride, tight);
  if (width < 1 || height < 1 ||
      bytes.size() < static_cast<std::size_t>(height - 1) * step + tight) {
    return std::nullopt;
  }
  Image<std::uint16_t> image{width, height};
  // Drivers differ in what they leave in the bits above the code.
  const unsigned mask = (1U << static_cast<unsigned>(format.bits)) - 1;
  switch (format.packing) {
    case Packing::Bytes:
      unpackRows<Packing::Bytes>(bytes, step, mask, image);
      break;
    case Packing::LittleEndian16:
      unpackRows<Packing::LittleEndian16>(bytes, step, mask, image);
      break;
    case Packing::BigEndian16:
      unpackRows<Packing::BigEndian16>(bytes, step, mask, image);
      break;
    case Packing::Mipi10:
      unpackRows<Packing::Mipi10>(bytes, step, mask, image);
      break;
    case Packing::Mipi12:
      unpackRows<Packing::Mipi12>(bytes, step, mask, image);
      break;
    case Packing::BitStream10:
      unpackRows<Packing::BitStream10>(bytes, step, mask, image);
      break;
  }
  return image;
}

}  // namespace toftwin::drivers::v4l2
