// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/short_images.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "daemon/facades/frame_views.h"

namespace toftwin::daemon {
namespace {

constexpr double kMost16 = 65'535.0;

/// 0 for what is no number, or does not fit.
std::uint16_t shortOf(double value) {
  const double count = std::round(value);
  return count >= 0.0 && count <= kMost16 ? static_cast<std::uint16_t>(count) : std::uint16_t{0};
}

template <class Value>
std::vector<std::byte> shortsOf(std::size_t pixels, Value value) {
  std::vector<std::byte> bytes(2 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::uint16_t count = shortOf(value(i));
    bytes[2 * i] = static_cast<std::byte>(count & 0xFFU);
    bytes[2 * i + 1] = static_cast<std::byte>(count >> 8U);
  }
  return bytes;
}

}  // namespace

std::optional<std::vector<std::byte>> ShortImages::depthOf(const Frame& frame) {
  constexpr double kMillimetres = 1000.0;
  const double per_metre = kMillimetres / scale_.depth_unit_mm;
  if (const Plane* depth = planeOf(frame, PlaneKind::Depth, ElementType::F32)) {
    const auto depth_m = depth->as<float>();
    return shortsOf(depth_m.size(),
                    [&](std::size_t i) { return per_metre * static_cast<double>(depth_m[i]); });
  }
  const Plane* range = planeOf(frame, PlaneKind::Range, ElementType::F32);
  if (range == nullptr) return std::nullopt;
  if (!rays_ || rays_->camera != frame.camera) rays_ = Rays{frame.camera, unitVectorsOf(frame.camera)};
  const auto range_m = range->as<float>();
  return shortsOf(range_m.size(), [&](std::size_t i) {
    const auto z = static_cast<double>(rays_->unit_vectors[3 * i + 2]);
    return per_metre * (static_cast<double>(range_m[i]) * z);
  });
}

std::optional<std::vector<std::byte>> ShortImages::amplitudeOf(const Frame& frame) const {
  const Plane* plane = planeOf(frame, PlaneKind::Amplitude, ElementType::F32);
  if (plane == nullptr) return std::nullopt;
  const auto amplitude = plane->as<float>();
  return shortsOf(amplitude.size(), [&](std::size_t i) {
    return std::min(static_cast<double>(amplitude[i]) / scale_.amplitude_per_count, kMost16);
  });
}

}  // namespace toftwin::daemon
