// SPDX-License-Identifier: Apache-2.0
#include "protocol/ros/pixels.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

#include "protocol/types/plane_of.h"

namespace toftwin::ros {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr double kMillimetres = 1000.0, kMost16 = 65'535.0;

const Plane* floatsOf(const Frame& frame, PlaneKind kind) { return toftwin::planeOf(frame, kind, ElementType::F32); }

template <class T>
std::vector<std::uint8_t> bytesOf(std::span<const T> values) {
  std::vector<std::uint8_t> bytes(values.size_bytes());
  if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

/// Metres along the optical axis. What the frame has is taken as it is; else depth = range · z of the ray.
std::vector<float> depths(const Frame& frame, const Rays& rays) {
  if (const Plane* depth = floatsOf(frame, PlaneKind::Depth)) {
    const auto metres = depth->as<float>();
    return {metres.begin(), metres.end()};
  }
  const Plane* range = floatsOf(frame, PlaneKind::Range);
  if (range == nullptr) return {};
  const auto metres = range->as<float>();
  std::vector<float> result(metres.size());
  for (std::size_t i = 0; i < metres.size(); ++i)
    result[i] = static_cast<float>(static_cast<double>(metres[i]) * rays.unit_vectors[i].z);
  return result;
}

std::uint16_t millimetresOf(float metres) {
  const double count = std::round(kMillimetres * static_cast<double>(metres));
  return count >= 1.0 && count <= kMost16 ? static_cast<std::uint16_t>(count) : std::uint16_t{0};
}

Pixels pixelsLike(const Frame& frame, std::string_view encoding, std::uint32_t bytes_per_pixel) {
  return {std::string{encoding},
          static_cast<std::uint32_t>(frame.camera.width),
          static_cast<std::uint32_t>(frame.camera.height),
          bytes_per_pixel,
          {}};
}

std::string encodingOf(const Plane& plane) {
  if (plane.channels == 1 && plane.type != ElementType::F32) return plane.type == ElementType::U16 ? "mono16" : "mono8";
  if (plane.kind == PlaneKind::Color && plane.channels == 3 && plane.type == ElementType::U8) return "rgb8";
  const char* element = plane.type == ElementType::F32 ? "32F" : plane.type == ElementType::U16 ? "16U" : "8U";
  return element + ("C" + std::to_string(plane.channels));
}

struct Shape {
  ElementType type = ElementType::U8;
  int channels = 1;
};
std::optional<Shape> shapeNamed(std::string_view encoding) {
  constexpr int kMostChannels = 64;
  if (encoding == "mono8") return Shape{ElementType::U8, 1};
  if (encoding == "mono16") return Shape{ElementType::U16, 1};
  if (encoding == "rgb8") return Shape{ElementType::U8, 3};
  Shape shape;
  if (encoding.starts_with("8UC")) shape.type = ElementType::U8;
  else if (encoding.starts_with("16UC")) shape.type = ElementType::U16;
  else if (encoding.starts_with("32FC")) shape.type = ElementType::F32;
  else return std::nullopt;
  const std::string_view digits = encoding.substr(encoding.find('C') + 1);
  const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), shape.channels);
  const bool is_number = read.ec == std::errc{} && read.ptr == digits.data() + digits.size();
  return is_number && shape.channels >= 1 && shape.channels <= kMostChannels ? std::optional{shape} : std::nullopt;
}

}  // namespace

Rays raysOf(const toftwin::CameraInfo& camera) {
  Rays rays{camera, {}};
  rays.unit_vectors.reserve(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) rays.unit_vectors.push_back(rayThroughPixel(camera, u, v).v);
  }
  return rays;
}

std::optional<Pixels> depthOf(const Frame& frame, const Rays& rays, DepthFormat format) {
  const std::vector<float> metres = depths(frame, rays);
  if (metres.empty()) return std::nullopt;
  if (format == DepthFormat::Metres) {
    Pixels pixels = pixelsLike(frame, "32FC1", sizeof(float));
    pixels.data = bytesOf(std::span{metres});
    return pixels;
  }
  std::vector<std::uint16_t> counts(metres.size());
  for (std::size_t i = 0; i < metres.size(); ++i) counts[i] = millimetresOf(metres[i]);
  Pixels pixels = pixelsLike(frame, "16UC1", sizeof(std::uint16_t));
  pixels.data = bytesOf(std::span<const std::uint16_t>{counts});
  return pixels;
}

std::optional<Pixels> amplitudeOf(const Frame& frame) {
  const Plane* plane = toftwin::planeOf(frame, PlaneKind::Amplitude);
  if (plane == nullptr) return std::nullopt;
  return pixelsOf(*plane);
}

Pixels pixelsOf(const Plane& plane) {
  const std::size_t size = sizeOf(plane.type);
  const auto channels = static_cast<std::size_t>(plane.channels);
  Pixels pixels{encodingOf(plane), static_cast<std::uint32_t>(plane.width), static_cast<std::uint32_t>(plane.height),
                static_cast<std::uint32_t>(size * channels), std::vector<std::uint8_t>(plane.data.size())};
  if (channels == 1) {
    pixels.data = bytesOf(plane.data.bytes());
    return pixels;
  }
  const auto* from = reinterpret_cast<const std::uint8_t*>(plane.data.bytes().data());
  const std::size_t count = plane.data.size() / (size * channels);
  for (std::size_t channel = 0; channel < channels; ++channel) {
    for (std::size_t i = 0; i < count; ++i, from += size) std::memcpy(&pixels.data[(i * channels + channel) * size], from, size);
  }
  return pixels;
}

std::optional<Plane> planeOf(PlaneKind kind, std::string_view encoding, std::uint32_t width, std::uint32_t height,
                             std::uint32_t step, bool is_bigendian, std::span<const std::byte> data) {
  constexpr std::uint32_t kMostPixels = 1u << 26;
  const auto shape = shapeNamed(encoding);
  if (!shape || width == 0 || height == 0 || width > kMostPixels || height > kMostPixels / width) return std::nullopt;
  const std::size_t size = sizeOf(shape->type), channels = static_cast<std::size_t>(shape->channels);
  const std::size_t row = width * size * channels, count = std::size_t{width} * height;
  if (step < row || data.size() < std::size_t{step} * (height - 1) + row) return std::nullopt;
  std::vector<std::byte, UnsetNumbers<std::byte>> bytes(count * size * channels);
  for (std::size_t y = 0; y < height; ++y) {
    const std::byte* from = data.data() + y * step;
    if (channels == 1 && !(is_bigendian && size > 1)) {
      std::memcpy(&bytes[y * row], from, row);
      continue;
    }
    for (std::size_t i = 0; i < width * channels; ++i, from += size) {
      std::byte* to = &bytes[((i % channels) * count + y * width + i / channels) * size];
      if (is_bigendian) std::reverse_copy(from, from + size, to);
      else std::memcpy(to, from, size);
    }
  }
  return Plane{kind, shape->type, static_cast<int>(width), static_cast<int>(height), shape->channels, Buffer::adopt(std::move(bytes))};
}

std::optional<Points> pointsOf(const Frame& frame, const Rays& rays) {
  static constexpr std::array<std::string_view, 4> kFields{"x", "y", "z", "intensity"};
  const Plane* range = floatsOf(frame, PlaneKind::Range);
  const Plane* depth = floatsOf(frame, PlaneKind::Depth);
  const Plane* amplitude = floatsOf(frame, PlaneKind::Amplitude);
  if (range == nullptr && depth == nullptr) return std::nullopt;
  const std::size_t fields = amplitude != nullptr ? 4 : 3;
  std::vector<float> numbers(fields * rays.unit_vectors.size(), kNone);
  for (std::size_t i = 0; i < rays.unit_vectors.size(); ++i) {
    const Vec3d& ray = rays.unit_vectors[i];
    const double range_m = range != nullptr ? static_cast<double>(range->as<float>()[i])
                                            : static_cast<double>(depth->as<float>()[i]) / ray.z;
    float* point = &numbers[fields * i];
    if (std::isfinite(range_m)) {
      point[0] = static_cast<float>(range_m * ray.x);
      point[1] = static_cast<float>(range_m * ray.y);
      point[2] = static_cast<float>(range_m * ray.z);
    }
    if (amplitude != nullptr) point[3] = amplitude->as<float>()[i];
  }
  return Points{static_cast<std::uint32_t>(frame.camera.width),
                static_cast<std::uint32_t>(frame.camera.height), std::span{kFields}.first(fields),
                bytesOf(std::span<const float>{numbers})};
}

std::int64_t stampOf(const Frame& frame, StampClock clock) {
  if (frame.moment.exposures.empty()) return frame.moment.received.ns;
  const std::int64_t host_minus_clock_ns = clock == StampClock::Host ? frame.moment.clock.host_minus_device_ns : 0;
  std::int64_t stamp_ns = 0;
  const bool is_too_far = __builtin_add_overflow(frame.moment.exposures.front().start.ns, host_minus_clock_ns, &stamp_ns);
  return is_too_far ? frame.moment.received.ns : stamp_ns;
}

}  // namespace toftwin::ros
