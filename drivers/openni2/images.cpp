// SPDX-License-Identifier: Apache-2.0
#include "drivers/openni2/images.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

#include <toftwin/nan.h>

namespace toftwin::drivers::openni2 {
namespace {

int bytesPerPixel(int format) {
  return format == ONI_PIXEL_FORMAT_GRAY8 ? 1 : format == ONI_PIXEL_FORMAT_RGB888 ? 3 : 2;
}

Result<> check(const RawImage& raw, int width, int height) {
  if (raw.width != width || raw.height != height) {
    return Error{
        Error::Code::Malformed,
        fmt::format("openni2: an image is {} x {}, the stream was opened with {} x {}; does "
                    "another program crop it?",
                    raw.width, raw.height, width, height)};
  }
  const std::int64_t row = std::int64_t{width} * bytesPerPixel(raw.format);
  const std::int64_t needed = std::int64_t{raw.stride} * (height - 1) + row;
  if (raw.stride < row || static_cast<std::int64_t>(raw.bytes.size()) < needed) {
    return Error{Error::Code::Malformed,
                 fmt::format("openni2: an image of {} x {} has {} bytes and {} per row", width,
                             height, raw.bytes.size(), raw.stride)};
  }
  return {};
}

std::uint16_t wordAt(const std::byte* at) {
  std::uint16_t value = 0;
  std::memcpy(&value, at, sizeof value);
  return value;
}
const std::byte* rowOf(const RawImage& raw, int y) {
  return raw.bytes.data() + static_cast<std::ptrdiff_t>(y) * raw.stride;
}

struct Rgb {
  std::uint8_t red, green, blue;
};
std::uint8_t clipped(double value) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
}
/// From video levels (Y 16…235, U and V 16…240).            [ITU-R BT.601-7, §2.5]
Rgb rgbOfYuv(int luma, int u, int v) {
  const double y = 255.0 / 219.0 * (luma - 16), b = 255.0 / 224.0 * (u - 128),
               r = 255.0 / 224.0 * (v - 128);
  return {clipped(y + 1.402 * r), clipped(y - 0.344136 * b - 0.714136 * r), clipped(y + 1.772 * b)};
}

Rgb rgbAt(int format, const std::byte* row, int x, int width) {
  const auto at = [&](int i) { return std::to_integer<std::uint8_t>(row[i]); };
  if (format == ONI_PIXEL_FORMAT_RGB888) return {at(3 * x), at(3 * x + 1), at(3 * x + 2)};
  if (format == ONI_PIXEL_FORMAT_GRAY8) return {at(x), at(x), at(x)};
  // Two pixels share their colour: U Y V Y or Y U Y V. An odd width leaves the last one without V.
  const int pair = 4 * (x / 2);
  const bool is_whole = x / 2 * 2 + 1 < width;
  const int first = format == ONI_PIXEL_FORMAT_YUV422 ? 0 : 1;
  return rgbOfYuv(at(pair + 1 - first + 2 * (x % 2)), at(pair + first),
                  is_whole ? at(pair + first + 2) : 128);
}

}  // namespace

int formatOf(const OniVideoMode& mode) {
  static_assert(sizeof mode.pixelFormat == sizeof(int));
  int format = 0;
  std::memcpy(&format, &mode.pixelFormat, sizeof format);
  return format;
}

bool isDepth(int format) {
  return format == ONI_PIXEL_FORMAT_DEPTH_1_MM || format == ONI_PIXEL_FORMAT_DEPTH_100_UM;
}
bool isInfrared(int format) {
  return format == ONI_PIXEL_FORMAT_GRAY16 || format == ONI_PIXEL_FORMAT_GRAY8;
}
bool isColor(int format) {
  return format == ONI_PIXEL_FORMAT_RGB888 || format == ONI_PIXEL_FORMAT_YUV422 ||
         format == ONI_PIXEL_FORMAT_YUYV || format == ONI_PIXEL_FORMAT_GRAY8;
}

Result<DepthImages> depthImages(const RawImage& raw, const Image<float>& depth_per_range) {
  const int width = depth_per_range.width(), height = depth_per_range.height();
  if (!isDepth(raw.format)) {
    return Error{Error::Code::Malformed,
                 fmt::format("openni2: pixel format {} is no depth", raw.format)};
  }
  if (auto checked = check(raw, width, height); !checked) return checked.error();
  const float unit_m = raw.format == ONI_PIXEL_FORMAT_DEPTH_1_MM ? 1e-3F : 1e-4F;
  DepthImages images{{width, height, kNaN}, {width, height, kNaN}, {width, height, 0}};
  for (int y = 0; y < height; ++y) {
    const std::byte* row = rowOf(raw, y);
    for (int x = 0; x < width; ++x) {
      const std::uint16_t code = wordAt(row + 2 * x);
      if (code == 0) {
        images.flags(x, y) = static_cast<std::uint8_t>(PixelFlag::Invalid);
        continue;
      }
      images.depth_m(x, y) = static_cast<float>(code) * unit_m;
      images.range_m(x, y) = images.depth_m(x, y) / depth_per_range(x, y);
    }
  }
  return images;
}

Result<Image<float>> infraredImage(const RawImage& raw, int width, int height) {
  if (!isInfrared(raw.format)) {
    return Error{
        Error::Code::Malformed,
        fmt::format("openni2: pixel format {} is no infrared image", raw.format)};
  }
  if (auto checked = check(raw, width, height); !checked) return checked.error();
  Image<float> image{width, height};
  for (int y = 0; y < height; ++y) {
    const std::byte* row = rowOf(raw, y);
    for (int x = 0; x < width; ++x) {
      image(x, y) = raw.format == ONI_PIXEL_FORMAT_GRAY8
                        ? static_cast<float>(std::to_integer<std::uint8_t>(row[x]))
                        : static_cast<float>(wordAt(row + 2 * x));
    }
  }
  return image;
}

Result<Plane> colorPlane(const RawImage& raw, int width, int height) {
  if (!isColor(raw.format)) {
    return Error{Error::Code::Malformed, fmt::format("openni2: pixel format {} is no colour",
                                                     raw.format)};
  }
  if (auto checked = check(raw, width, height); !checked) return checked.error();
  const std::size_t size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::vector<std::uint8_t> channels(3 * size);
  std::size_t i = 0;
  for (int y = 0; y < height; ++y) {
    const std::byte* row = rowOf(raw, y);
    for (int x = 0; x < width; ++x, ++i) {
      const Rgb rgb = rgbAt(raw.format, row, x, width);
      channels[i] = rgb.red;
      channels[size + i] = rgb.green;
      channels[2 * size + i] = rgb.blue;
    }
  }
  return Plane{.kind = PlaneKind::Color,
               .type = ElementType::U8,
               .width = width,
               .height = height,
               .channels = 3,
               .data = Buffer::adopt(std::move(channels))};
}

}  // namespace toftwin::drivers::openni2
