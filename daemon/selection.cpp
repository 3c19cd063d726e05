// SPDX-License-Identifier: Apache-2.0
#include "daemon/selection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include <toftwin/names.h>

#include "protocol/wire/codec.h"

namespace toftwin::daemon {
namespace {

struct Rectangle {
  std::size_t x, y, width, height;
};

Result<Rectangle> rectangleIn(const wire::Region& region, int width, int height) {
  const auto w = static_cast<std::uint64_t>(width), h = static_cast<std::uint64_t>(height);
  if (region.width == 0) return Rectangle{0, 0, w, h};
  if (region.height == 0 || std::uint64_t{region.x} + region.width > w ||
      std::uint64_t{region.y} + region.height > h) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("the region {} x {} at ({}, {}) is empty or does not lie in the image of "
                    "{} x {} pixels",
                    region.width, region.height, region.x, region.y, width, height)};
  }
  return Rectangle{region.x, region.y, region.width, region.height};
}

std::size_t countOf(std::size_t length, std::size_t step) { return (length + step - 1) / step; }

std::uint64_t fewestPixelBytes(PlaneKind kind) {
  switch (kind) {
    case PlaneKind::Flags:
    case PlaneKind::Exposure:
      return sizeof(std::uint8_t);
    case PlaneKind::Color:
      return 3 * sizeof(std::uint8_t);
    case PlaneKind::Samples:
      return sizeof(std::uint16_t);
    case PlaneKind::Phasors:
      return 2 * sizeof(float);
    case PlaneKind::TruthNormal:
      return 3 * sizeof(float);
    case PlaneKind::Range:
    case PlaneKind::Depth:
    case PlaneKind::Amplitude:
    case PlaneKind::Ambient:
    case PlaneKind::TruthRange:
    case PlaneKind::LightSigma:
      return sizeof(float);
  }
  return 0;
}

Plane cut(const Plane& plane, const Rectangle& part, std::size_t step) {
  const std::size_t element = sizeOf(plane.type);
  const std::size_t row_bytes = static_cast<std::size_t>(plane.width) * element;
  const std::size_t width = countOf(part.width, step), height = countOf(part.height, step);
  std::vector<std::byte> bytes(width * height * static_cast<std::size_t>(plane.channels) * element);
  std::byte* out = bytes.data();
  for (std::size_t channel = 0; channel < static_cast<std::size_t>(plane.channels); ++channel) {
    const std::byte* image =
        plane.data.bytes().data() + channel * row_bytes * static_cast<std::size_t>(plane.height);
    for (std::size_t v = 0; v < height; ++v) {
      const std::byte* row = image + (part.y + v * step) * row_bytes + part.x * element;
      if (step == 1) {
        std::memcpy(out, row, width * element);
        out += width * element;
        continue;
      }
      for (std::size_t u = 0; u < width; ++u, out += element) {
        std::memcpy(out, row + u * step * element, element);
      }
    }
  }
  return {plane.kind,
          plane.type,
          static_cast<int>(width),
          static_cast<int>(height),
          plane.channels,
          Buffer::adopt(std::move(bytes))};
}

CameraInfo cameraOf(CameraInfo camera, const Rectangle& part, std::size_t step) {
  const auto n = static_cast<double>(step);
  camera.width = static_cast<int>(countOf(part.width, step));
  camera.height = static_cast<int>(countOf(part.height, step));
  camera.cx = (camera.cx - static_cast<double>(part.x)) / n;
  camera.cy = (camera.cy - static_cast<double>(part.y)) / n;
  camera.fx /= n;
  camera.fy /= n;
  return camera;
}

bool isWhole(const Rectangle& part, const Plane& plane, std::size_t step) {
  return step == 1 && part.width == static_cast<std::size_t>(plane.width) &&
         part.height == static_cast<std::size_t>(plane.height);
}

}  // namespace

std::uint64_t bytesOf(const Selection& selection, const CameraInfo& camera,
                      const std::vector<PlaneKind>& planes, const PixelBytes& known) {
  const auto part = rectangleIn(selection.region, camera.width, camera.height);
  if (!part || selection.decimation == 0) return 0;
  std::uint64_t of_pixel = 0;
  for (const PlaneKind kind : selection.planes.empty() ? planes : selection.planes) {
    if (std::ranges::find(planes, kind) == planes.end()) continue;
    const auto found = known.find(kind);
    of_pixel += found == known.end() ? fewestPixelBytes(kind) : found->second;
  }
  const std::uint32_t step = selection.decimation;
  return countOf(part->width, step) * countOf(part->height, step) * of_pixel;
}

Result<> checkFrameBytes(std::uint64_t bytes) {
  constexpr std::uint64_t kMost = wire::Limits{}.body_bytes;
  if (bytes <= kMost) return {};
  return Error{Error::Code::TooLarge,
               fmt::format("one frame has {} MiB, and a message at most {}: ask for fewer planes, a region or "
                           "a decimation",
                           (bytes + (1u << 20) - 1) >> 20, kMost >> 20)};
}

Result<> checkSelection(const Selection& selection, const CameraInfo& camera,
                        const std::vector<PlaneKind>& planes) {
  for (const PlaneKind kind : selection.planes) {
    if (!selection.those_it_has && std::ranges::find(planes, kind) == planes.end()) {
      std::string known;
      for (const PlaneKind has : planes) {
        known += (known.empty() ? "" : ", ") + std::string{nameOf(has)};
      }
      return Error{Error::Code::InvalidArgument,
                   fmt::format("there is no plane \"{}\"; there are: {}", nameOf(kind), known)};
    }
    if (std::ranges::count(selection.planes, kind) > 1) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("the plane \"{}\" is asked for twice", nameOf(kind))};
    }
  }
  if (selection.decimation == 0) {
    return Error{Error::Code::InvalidArgument, "a decimation of 0 leaves no pixels; 1 keeps all"};
  }
  if (auto part = rectangleIn(selection.region, camera.width, camera.height); !part) {
    return part.error();
  }
  return {};
}

Result<Frame> select(const Frame& frame, const Selection& selection) {
  const auto part = rectangleIn(selection.region, frame.camera.width, frame.camera.height);
  if (!part) return part.error();
  const std::size_t step = selection.decimation;
  Frame selected = frame;
  if (!selection.planes.empty()) {
    selected.planes.clear();
    for (const PlaneKind kind : selection.planes) {
      if (const Plane* plane = frame.find(kind)) selected.planes.push_back(*plane);
    }
  }
  for (Plane& plane : selected.planes) {
    // Defensive only against a driver that breaks its contract: the rectangle is the camera's.
    if (plane.width != frame.camera.width || plane.height != frame.camera.height) {
      return Error{
          Error::Code::Internal,
          fmt::format("the plane \"{}\" has another size than the camera", nameOf(plane.kind))};
    }
    if (!isWhole(*part, plane, step)) plane = cut(plane, *part, step);
  }
  selected.camera = cameraOf(frame.camera, *part, step);
  return selected;
}

}  // namespace toftwin::daemon
