// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/images.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace toftwin::drivers::aravis {
namespace {

using Element = PixelFormat::Element;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr std::int64_t kLargestPartSide = 65'535;  // of any part, so that products fit 64 bits

constexpr unsigned bit(PixelFlag flag) { return static_cast<unsigned>(flag); }

// Formats that a range image may have although they say intensity: C alone, with its scale.
PixelFormat formatOf(const Part& part, const PixelFormat& format) {
  PixelFormat as = format;
  if (part.is_range && format.role == Role::Intensity) as.role = Role::Range;
  return as;
}

std::optional<PixelFormat> formatOf(const Part& part) {
  const PixelFormat* format = pixelFormatOf(part.format);
  if (format == nullptr) return std::nullopt;
  return formatOf(part, *format);
}

/// Bytes that a part must have, after its sides were checked.
std::uint64_t bytesNeeded(const Part& part, const PixelFormat& format) {
  const auto width = static_cast<std::uint64_t>(part.width),
             height = static_cast<std::uint64_t>(part.height),
             padding = static_cast<std::uint64_t>(part.row_padding);
  const std::uint64_t channels = static_cast<std::uint64_t>(format.channels);
  const std::uint64_t per_pixel = sizeOf(format.element) * (format.is_planar ? 1 : channels);
  const std::uint64_t rows = height * (format.is_planar ? channels : 1);
  return rows * (width * per_pixel + padding) - padding;
}

Result<> checkBytes(const Part& part, const PixelFormat& format) {
  const bool has_sides = part.width > 0 && part.height > 0 && part.width <= kLargestPartSide &&
                         part.height <= kLargestPartSide && part.row_padding >= 0 &&
                         part.row_padding <= kLargestPartSide;
  if (!has_sides) {
    return Error{Error::Code::Malformed,
                 fmt::format("aravis: an image of {} x {} pixels with {} bytes after each row",
                             part.width, part.height, part.row_padding)};
  }
  if (const std::uint64_t needed = bytesNeeded(part, format); part.bytes.size() < needed) {
    return Error{Error::Code::Malformed,
                 fmt::format("aravis: the {} image has {} bytes, {} x {} pixels need {}",
                             format.name, part.bytes.size(), part.width, part.height, needed)};
  }
  return {};
}

template <Element element>
double codeAt(const std::byte* at) {
  const auto byte = [at](int i) { return std::to_integer<std::uint32_t>(at[i]); };
  if constexpr (element == Element::U8) return byte(0);
  if constexpr (element == Element::U16) return byte(0) | byte(1) << 8U;
  if constexpr (element == Element::F32) {
    return static_cast<double>(
        std::bit_cast<float>(byte(0) | byte(1) << 8U | byte(2) << 16U | byte(3) << 24U));
  }
}

/// Calls `take(pixel, codes)` for each pixel with its codes, whose bytes were checked.
template <Element element, int channels, class Take>
void readAs(const Part& part, const PixelFormat& format, Take take) {
  const auto width = static_cast<std::size_t>(part.width),
             height = static_cast<std::size_t>(part.height);
  const std::size_t size = sizeOf(element);
  const std::size_t step = format.is_planar ? size : size * channels;
  const std::size_t stride = width * step + static_cast<std::size_t>(part.row_padding);
  const std::size_t channel = format.is_planar ? stride * height : size;
  std::size_t pixel = 0;
  for (std::size_t y = 0; y < height; ++y) {
    const std::byte* at = part.bytes.data() + y * stride;
    for (std::size_t x = 0; x < width; ++x, at += step, ++pixel) {
      std::array<double, channels> codes;
      for (std::size_t c = 0; c < channels; ++c) codes[c] = codeAt<element>(at + c * channel);
      take(pixel, codes);
    }
  }
}

template <int channels, class Take>
void readPixels(const Part& part, const PixelFormat& format, Take take) {
  if (format.element == Element::U8) readAs<Element::U8, channels>(part, format, take);
  if (format.element == Element::U16) readAs<Element::U16, channels>(part, format, take);
  if (format.element == Element::F32) readAs<Element::F32, channels>(part, format, take);
}

/// In metres; NaN where the code says that there is no value.
double coordinate(double code, const Scan3d::Axis& axis, double unit_m) {
  if (std::isnan(code) || (axis.invalid && code == *axis.invalid)) return std::nan("");
  return (axis.scale * code + axis.offset) * unit_m;
}

std::array<double, 3> pointOf(const std::array<double, 3>& codes, const Scan3d& scan) {
  std::array<double, 3> point{};
  for (std::size_t i = 0; i < 3; ++i) point[i] = coordinate(codes[i], scan.axes[i], scan.unit_m);
  return point;
}

/// What cannot be a length is none; a float may not hold what a double can.
float lengthOr(double length_m) {
  const auto length = static_cast<float>(length_m);
  return std::isfinite(length) && length > 0.0F ? length : kNone;
}

Image<float> numbersOf(const Part& part, const PixelFormat& format, int width, int height) {
  Image<float> image{width, height};
  readPixels<1>(part, format, [&](std::size_t pixel, const auto& codes) {
    image[pixel] = static_cast<float>(codes[0]);
  });
  return image;
}

}  // namespace

struct ImageMaker::Distances {
  Image<float> range_m, depth_m;
};

ImageMaker::ImageMaker(Layout layout, Scan3d scan, Lens lens)
    : layout_(layout),
      scan_(scan),
      lens_(std::move(lens)),
      depth_per_range_(depthPerRange(lens_.camera)) {}

bool ImageMaker::isAnnounced(PlaneKind kind) const {
  if (kind == PlaneKind::Amplitude) return layout_.has_intensity;
  if (!layout_.has_range) return false;
  const bool has_both = layout_.has_points || lens_.is_known;
  if (kind == PlaneKind::Range) return has_both || scan_.c_is_range;
  if (kind == PlaneKind::Depth) return has_both || !scan_.c_is_range;
  return kind == PlaneKind::Flags;
}

std::vector<PlaneKind> ImageMaker::kinds() const {
  std::vector<PlaneKind> kinds;
  for (const PlaneKind kind :
       {PlaneKind::Range, PlaneKind::Depth, PlaneKind::Amplitude, PlaneKind::Flags}) {
    if (isAnnounced(kind)) kinds.push_back(kind);
  }
  return kinds;
}

Result<> ImageMaker::check(const Part& part, const PixelFormat& format) const {
  if (part.width != lens_.camera.width || part.height != lens_.camera.height) {
    return Error{
        Error::Code::Malformed,
        fmt::format("aravis: the {} image is {} x {}, the camera had {} x {} when it was opened",
                    format.name, part.width, part.height, lens_.camera.width, lens_.camera.height)};
  }
  return checkBytes(part, format);
}

/// Range and depth, NaN where there is no value.
ImageMaker::Distances ImageMaker::distancesOf(const Part& part, const PixelFormat& format) const {
  const int width = lens_.camera.width, height = lens_.camera.height;
  Distances images{Image<float>{width, height}, Image<float>{width, height}};
  if (format.channels == 3) {
    readPixels<3>(part, format, [&](std::size_t pixel, const std::array<double, 3>& codes) {
      const auto [x, y, z] = pointOf(codes, scan_);
      // The point says both: range = |(x, y, z)|, depth = z.
      const float range_m = lengthOr(std::sqrt(x * x + y * y + z * z)), depth_m = lengthOr(z);
      const bool is_valid = !std::isnan(range_m) && !std::isnan(depth_m);
      images.range_m[pixel] = is_valid ? range_m : kNone;
      images.depth_m[pixel] = is_valid ? depth_m : kNone;
    });
    return images;
  }
  readPixels<1>(part, format, [&](std::size_t pixel, const std::array<double, 1>& codes) {
    const double length_m = coordinate(codes[0], scan_.axes[2], scan_.unit_m);
    // depth = range · z, with z of the pixel's unit ray
    const double z = static_cast<double>(depth_per_range_[pixel]);
    const float range_m = lengthOr(scan_.c_is_range ? length_m : length_m / z);
    const float depth_m = lengthOr(scan_.c_is_range ? length_m * z : length_m);
    const bool is_valid = !std::isnan(range_m) && !std::isnan(depth_m);
    images.range_m[pixel] = is_valid ? range_m : kNone;
    images.depth_m[pixel] = is_valid ? depth_m : kNone;
  });
  return images;
}

Result<std::vector<Plane>> ImageMaker::planes(std::span<const Part> parts) const {
  const int width = lens_.camera.width, height = lens_.camera.height;
  Distances distances;
  Image<float> strength, confidence;
  const auto read = [&](Role role, const char* name, auto take) -> Result<> {
    const Part* part = partFor(role, parts);
    const auto format = part == nullptr ? std::nullopt : formatOf(*part);
    if (!format) {
      return Error{Error::Code::Malformed,
                   fmt::format("aravis: the frame has no {} image that can be read", name)};
    }
    if (role == Role::Range && (format->channels == 3) != layout_.has_points) {
      return Error{Error::Code::Malformed,
                   "aravis: the range image has another pixel format than "
                   "when the camera was opened"};
    }
    if (auto checked = check(*part, *format); !checked) return checked;
    take(*part, *format);
    return {};
  };
  Result<> done;
  if (layout_.has_range) {
    done = read(Role::Range, "range",
                [&](const Part& part, const PixelFormat& f) { distances = distancesOf(part, f); });
  }
  if (done && layout_.has_intensity) {
    done = read(Role::Intensity, "intensity", [&](const Part& part, const PixelFormat& f) {
      strength = numbersOf(part, f, width, height);
    });
  }
  if (done && layout_.has_confidence) {
    done = read(Role::Confidence, "confidence", [&](const Part& part, const PixelFormat& f) {
      confidence = numbersOf(part, f, width, height);
    });
  }
  if (!done) return done.error();

  Image<std::uint8_t> flags{layout_.has_range ? width : 0, layout_.has_range ? height : 0};
  for (std::size_t i = 0; i < flags.size(); ++i) {
    unsigned flag = std::isnan(distances.range_m[i]) ? bit(PixelFlag::Invalid) : 0;
    if (layout_.has_confidence && static_cast<double>(confidence[i]) < layout_.least_confidence) {
      flag |= bit(PixelFlag::Invalid) | bit(PixelFlag::LowAmplitude);
      distances.range_m[i] = distances.depth_m[i] = kNone;
    }
    flags[i] = static_cast<std::uint8_t>(flag);
  }
  std::vector<Plane> planes;
  for (const PlaneKind kind : kinds()) {
    if (kind == PlaneKind::Range) planes.push_back(toPlane(kind, std::move(distances.range_m)));
    if (kind == PlaneKind::Depth) planes.push_back(toPlane(kind, std::move(distances.depth_m)));
    if (kind == PlaneKind::Amplitude) planes.push_back(toPlane(kind, std::move(strength)));
    if (kind == PlaneKind::Flags) planes.push_back(toPlane(kind, std::move(flags)));
  }
  return planes;
}

Result<std::vector<float>> raysOf(const Part& part, const Scan3d& scan) {
  const auto format = formatOf(part);
  if (!format || format->channels != 3) {
    return Error{Error::Code::Malformed, "aravis: the range image has no A, B and C"};
  }
  if (auto checked = checkBytes(part, *format); !checked) return checked.error();
  std::vector<float> rays(static_cast<std::size_t>(part.width * part.height) * 3);
  readPixels<3>(part, *format, [&](std::size_t pixel, const std::array<double, 3>& codes) {
    const auto point = pointOf(codes, scan);
    const bool is_valid =
        std::ranges::all_of(point, [](double x) { return std::isfinite(static_cast<float>(x)); });
    for (std::size_t i = 0; i < 3 && is_valid; ++i)
      rays[3 * pixel + i] = static_cast<float>(point[i]);
  });
  return rays;
}

const Part* partFor(Role role, std::span<const Part> parts) {
  const auto matches = [&](const Part& part) {
    const auto format = formatOf(part);
    return format && format->role == role;
  };
  if (role == Role::Intensity) {
    for (const std::uint32_t component : {1U, 5U, 2U}) {
      const auto found = std::ranges::find_if(
          parts, [&](const Part& part) { return part.component == component && matches(part); });
      if (found != parts.end()) return &*found;
    }
  }
  const auto found = std::ranges::find_if(parts, matches);
  return found == parts.end() ? nullptr : &*found;
}

}  // namespace toftwin::drivers::aravis
