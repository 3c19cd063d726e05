// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/ros2/images.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "daemon/facades/frame_views.h"

namespace toftwin::daemon::ros2 {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr double kMillimetres = 1000.0, kMost16 = 65'535.0;

const Plane* floatsOf(const Frame& frame, PlaneKind kind) { return planeOf(frame, kind, ElementType::F32); }

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
  return {encoding,
          static_cast<std::uint32_t>(frame.camera.width),
          static_cast<std::uint32_t>(frame.camera.height),
          bytes_per_pixel,
          {}};
}

}  // namespace

Rays raysOf(const CameraInfo& camera) {
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
  const Plane* plane = planeOf(frame, PlaneKind::Amplitude);
  if (plane == nullptr) return std::nullopt;
  const std::string_view encoding = plane->type == ElementType::F32   ? "32FC1"
                                    : plane->type == ElementType::U16 ? "mono16"
                                                                      : "mono8";
  Pixels pixels = pixelsLike(frame, encoding, static_cast<std::uint32_t>(sizeOf(plane->type)));
  pixels.data = bytesOf(plane->data.bytes());
  return pixels;
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
  return frame.moment.exposures.front().start.ns +
         (clock == StampClock::Host ? frame.moment.clock.host_minus_device_ns : 0);
}

}  // namespace toftwin::daemon::ros2
