// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/openni2/images.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "daemon/facades/openni2/facts.h"

namespace toftwin::openni2 {
namespace {

constexpr double kMost16 = 65'535.0;

/// The frame's plane of that type and of the mode's size, or null.
const Plane* planeFor(const Frame& frame, PlaneKind kind, ElementType type, int channels, const OniVideoMode& mode) {
  const Plane* plane = frame.find(kind);
  const bool fits = plane != nullptr && plane->type == type && plane->channels == channels &&
                    plane->width == mode.resolutionX && plane->height == mode.resolutionY &&
                    plane->data.size() == plane->byteSize();
  return fits ? plane : nullptr;
}

bool isInside(const Window& window, const OniVideoMode& mode) {
  return window.x >= 0 && window.y >= 0 && window.width > 0 && window.height > 0 &&
         window.width <= mode.resolutionX && window.height <= mode.resolutionY &&
         window.x <= mode.resolutionX - window.width && window.y <= mode.resolutionY - window.height;
}

/// Calls `take(index of the camera's pixel)` for each pixel that is given, in order.
template <class Take>
void forWindow(const ImageSetup& setup, Take take) {
  const int width = setup.mode.resolutionX;
  for (int v = setup.window.y; v < setup.window.y + setup.window.height; ++v) {
    for (int x = setup.window.x; x < setup.window.x + setup.window.width; ++x) {
      const int u = setup.is_mirrored ? width - 1 - x : x;
      take(static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u));
    }
  }
}

struct Words {
  std::byte* at;
  void put(std::uint16_t word) {
    std::memcpy(at, &word, sizeof word);  // in the host's order, as OpenNI2's pixels are
    at += sizeof word;
  }
};

/// Units of the format per metre.
double perMetre(OniPixelFormat format) { return format == ONI_PIXEL_FORMAT_DEPTH_100_UM ? 10'000.0 : 1000.0; }

bool drawDepth(const Frame& frame, const std::vector<double>& depth_per_range, const ImageSetup& setup,
               Words out) {
  const Plane* depth = planeFor(frame, PlaneKind::Depth, ElementType::F32, 1, setup.mode);
  const Plane* range = planeFor(frame, PlaneKind::Range, ElementType::F32, 1, setup.mode);
  const Plane* plane = depth != nullptr ? depth : range;
  if (plane == nullptr) return false;
  const auto metres = plane->as<float>();
  if (depth == nullptr && depth_per_range.size() != metres.size()) return false;
  const double units = perMetre(setup.mode.pixelFormat);
  const double beyond = maxDepthCode(setup.mode.pixelFormat, setup.max_depth);
  forWindow(setup, [&](std::size_t i) {
    const double depth_m = static_cast<double>(metres[i]) * (depth == nullptr ? depth_per_range[i] : 1.0);
    const double code = std::round(units * depth_m);  // halves away from zero
    out.put(code >= 1.0 && code < beyond ? static_cast<std::uint16_t>(code) : std::uint16_t{0});
  });
  return true;
}

bool drawInfrared(const Frame& frame, const ImageSetup& setup, Words out) {
  const Plane* plane = planeFor(frame, PlaneKind::Amplitude, ElementType::F32, 1, setup.mode);
  if (plane == nullptr) return false;
  const auto amplitude = plane->as<float>();
  forWindow(setup, [&](std::size_t i) {
    const double count = std::round(static_cast<double>(amplitude[i]) / setup.amplitude_per_count);
    out.put(count >= 1.0 ? static_cast<std::uint16_t>(std::min(count, kMost16)) : std::uint16_t{0});
  });
  return true;
}

/// One image per colour becomes red, green and blue of each pixel.
bool drawColor(const Frame& frame, const ImageSetup& setup, std::byte* out) {
  const Plane* plane = planeFor(frame, PlaneKind::Color, ElementType::U8, 3, setup.mode);
  if (plane == nullptr) return false;
  const auto bytes = plane->data.bytes();
  const std::size_t pixels = bytes.size() / 3;
  forWindow(setup, [&](std::size_t i) {
    for (std::size_t channel = 0; channel < 3; ++channel) *out++ = bytes[channel * pixels + i];
  });
  return true;
}

}  // namespace

std::vector<double> depthPerRange(const CameraInfo& camera) {
  std::vector<double> z;
  z.reserve(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) z.push_back(rayThroughPixel(camera, u, v).v.z);
  }
  return z;
}

int maxDepthCode(OniPixelFormat format, Length max_depth) {
  return static_cast<int>(std::min(kMost16, std::floor(max_depth.in(metre) * perMetre(format))));
}

std::size_t draw(const Frame& frame, const std::vector<double>& depth_per_range, const ImageSetup& setup,
                 std::span<std::byte> out) {
  if (!isInside(setup.window, setup.mode)) return 0;
  const std::size_t size = static_cast<std::size_t>(setup.window.width) *
                           static_cast<std::size_t>(setup.window.height) *
                           static_cast<std::size_t>(bytesPerPixel(setup.mode.pixelFormat));
  if (out.size() < size) return 0;
  bool is_drawn = false;
  if (setup.mode.pixelFormat == ONI_PIXEL_FORMAT_RGB888) {
    is_drawn = drawColor(frame, setup, out.data());
  } else if (setup.mode.pixelFormat == ONI_PIXEL_FORMAT_GRAY16) {
    is_drawn = drawInfrared(frame, setup, {out.data()});
  } else {
    is_drawn = drawDepth(frame, depth_per_range, setup, {out.data()});
  }
  return is_drawn ? size : 0;
}

std::uint64_t stampOf(const Frame& frame) {
  const auto& exposures = frame.moment.exposures;
  const std::int64_t ns = exposures.empty() ? frame.moment.received.ns : exposures.front().start.ns;
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, ns)) / 1000;
}

}  // namespace toftwin::openni2
