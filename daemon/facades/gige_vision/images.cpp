// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/gige_vision/images.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>

#include "daemon/facades/frame_views.h"

namespace toftwin::daemon::gige_vision {
namespace {

constexpr double kMillimetres = 1000.0, kMost16 = 65'535.0, kMost8 = 255.0;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr std::uint32_t kImageChunk = 1;

bool isFloat(std::uint32_t format) { return format == Pixel::kC32f || format == Pixel::kAbc32f; }
bool hasPoints(std::uint32_t format) { return format == Pixel::kAbc16 || format == Pixel::kAbc32f; }
/// PFNC: bits 16 to 23 of a format are the bits of a pixel.
std::uint32_t bytesPerPixel(std::uint32_t format) { return (format >> 16U & 0xFF) / 8; }

/// Where the next pixel goes. Little endian, as everywhere but in registers.
struct Cursor {
  std::byte* at;
  void put(std::uint32_t number, unsigned size) {
    for (unsigned i = 0; i < size; ++i) *at++ = static_cast<std::byte>(number >> (8 * i));
  }
  void put(float number) { put(std::bit_cast<std::uint32_t>(number), 4); }
};

/// 0 for what is no number, or does not fit.
std::uint32_t countOf(double value, double most) {
  const double count = std::round(value);
  return count >= 0.0 && count <= most ? static_cast<std::uint32_t>(count) : 0U;
}

/// Calls `take(index)` for each pixel of the region.
template <class Take>
void forRegion(const ImageSetup& setup, const CameraInfo& camera, Take take) {
  const auto width = static_cast<std::size_t>(camera.width);
  for (std::size_t v = setup.y; v < std::size_t{setup.y} + setup.height; ++v) {
    for (std::size_t u = setup.x; u < std::size_t{setup.x} + setup.width; ++u) take(v * width + u);
  }
}

/// Range along the ray and depth of one pixel, metres; NaN where there is none.
struct Distance {
  double range_m = std::nan(""), depth_m = std::nan("");
};
class Distances {
 public:
  Distances(const Frame& frame, const Rays& rays)
      : range_(planeOf(frame, PlaneKind::Range, ElementType::F32)),
        depth_(planeOf(frame, PlaneKind::Depth, ElementType::F32)),
        rays_(rays) {}
  [[nodiscard]] bool isEmpty() const { return range_ == nullptr && depth_ == nullptr; }
  /// What the frame has is taken as it is; the other follows from the pixel's ray: depth = range · z.
  [[nodiscard]] Distance at(std::size_t i) const {
    const auto z = static_cast<double>(rays_.unit_vectors[3 * i + 2]);
    Distance d;
    if (range_ != nullptr) d.range_m = static_cast<double>(range_->as<float>()[i]);
    if (depth_ != nullptr) d.depth_m = static_cast<double>(depth_->as<float>()[i]);
    if (range_ == nullptr) d.range_m = d.depth_m / z;
    if (depth_ == nullptr) d.depth_m = d.range_m * z;
    return d;
  }

 private:
  const Plane *range_, *depth_;
  const Rays& rays_;
};

void putPoint(Cursor& to, const std::array<double, 3>& point_mm, std::uint32_t format, double scale_mm) {
  const bool is_valid = std::ranges::all_of(point_mm, [](double x) { return std::isfinite(x); });
  if (format == Pixel::kAbc32f) {
    for (const double x : point_mm) to.put(is_valid ? static_cast<float>(x) : kNone);
    return;
  }
  // count = (coordinate - offset) / scale; a point of which one coordinate does not fit is none.
  std::array<std::uint32_t, 3> counts{};
  for (std::uint32_t i = 0; i < 3; ++i) {
    const Axis axis = axisOf(format, i, scale_mm);
    counts[i] = countOf((point_mm[i] - axis.offset_mm) / axis.scale_mm, kMost16);
  }
  const bool fits = is_valid && std::ranges::count(counts, 0U) == 0;
  for (const std::uint32_t count : counts) to.put(fits ? count : 0U, 2);
}

void putRange(Cursor to, const Frame& frame, const Rays& rays, const ImageSetup& setup) {
  const Distances distances{frame, rays};
  const std::uint32_t format = setup.formats[Component::kRange];
  forRegion(setup, frame.camera, [&](std::size_t i) {
    const Distance d = distances.at(i);
    if (hasPoints(format)) {
      std::array<double, 3> point_mm{};
      for (std::size_t k = 0; k < 3; ++k)
        point_mm[k] = kMillimetres * d.range_m * static_cast<double>(rays.unit_vectors[3 * i + k]);
      return putPoint(to, point_mm, format, setup.scale_mm);
    }
    const double length_mm = kMillimetres * (setup.is_spherical ? d.range_m : d.depth_m);
    if (format == Pixel::kC32f)
      return to.put(std::isfinite(length_mm) ? static_cast<float>(length_mm) : kNone);
    to.put(countOf(length_mm / setup.scale_mm, kMost16), 2);
  });
}

void putIntensity(Cursor to, const Frame& frame, const ImageSetup& setup) {
  const Plane& plane = *planeOf(frame, PlaneKind::Amplitude, ElementType::F32);
  const bool is_short = setup.formats[Component::kIntensity] == Pixel::kMono8;
  const double most = is_short ? kMost8 : kMost16;
  forRegion(setup, frame.camera, [&](std::size_t i) {
    const double counts = static_cast<double>(plane.as<float>()[i]) / setup.amplitude_per_count;
    to.put(countOf(std::min(counts, most), most), is_short ? 1 : 2);
  });
}

/// 0: no value; half: there is a value and a warning; else all.
void putConfidence(Cursor to, const Frame& frame, const ImageSetup& setup) {
  const Plane& plane = *planeOf(frame, PlaneKind::Flags, ElementType::U8);
  const bool is_short = setup.formats[Component::kConfidence] == Pixel::kConfidence8;
  const std::uint32_t most = is_short ? 255 : 65'535;
  forRegion(setup, frame.camera, [&](std::size_t i) {
    const std::uint8_t flags = plane.as<std::uint8_t>()[i];
    const bool is_invalid = (flags & static_cast<std::uint8_t>(PixelFlag::Invalid)) != 0;
    to.put(is_invalid ? 0 : flags != 0 ? (most + 1) / 2 : most, is_short ? 1 : 2);
  });
}

/// Each chunk before its own id and length.
void appendChunks(Bytes& bytes, const Frame& frame, const ImageSetup& setup, std::int64_t stamp_ns,
                  std::size_t image_bytes) {
  const auto end = [&](std::uint32_t id, std::size_t size) {
    append(bytes, id, 4);
    append(bytes, size, 4);
  };
  if (!setup.is_multipart) end(kImageChunk, image_bytes);
  double exposure_us = 0.0;
  for (const Exposure& one : frame.moment.exposures)
    exposure_us = std::max(exposure_us, one.duration.in(microsecond));
  const std::array<std::uint64_t, 3> numbers{static_cast<std::uint64_t>(stamp_ns),
                                             std::bit_cast<std::uint64_t>(exposure_us), frame.sequence};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!setup.has_chunk[i]) continue;
    append(bytes, numbers[i], 8);
    end(allChunks()[i].id, 8);
  }
}

bool hasChunks(const ImageSetup& setup) { return std::ranges::count(setup.has_chunk, true) > 0; }

Result<> check(const Frame& frame, const ImageSetup& setup) {
  if (payloadSizeOf(setup) == 0)
    return Error{Error::Code::Unsupported, "the source has no image of those that are enabled to be sent"};
  const auto width = static_cast<std::uint64_t>(std::max(0, frame.camera.width)),
             height = static_cast<std::uint64_t>(std::max(0, frame.camera.height));
  if (std::uint64_t{setup.x} + setup.width > width || std::uint64_t{setup.y} + setup.height > height) {
    return Error{
        Error::Code::Unsupported,
        fmt::format("the source's image is {} x {} now, smaller than the region that is set", width, height)};
  }
  const bool has_distance = planeOf(frame, PlaneKind::Range, ElementType::F32) != nullptr ||
                            planeOf(frame, PlaneKind::Depth, ElementType::F32) != nullptr;
  const bool lacks =
      (setup.is_sent[Component::kRange] && !has_distance) ||
      (setup.is_sent[Component::kIntensity] &&
       planeOf(frame, PlaneKind::Amplitude, ElementType::F32) == nullptr) ||
      (setup.is_sent[Component::kConfidence] && planeOf(frame, PlaneKind::Flags, ElementType::U8) == nullptr);
  if (lacks) return Error{Error::Code::Unsupported, "the source's frame lacks an image that is to be sent"};
  return {};
}

}  // namespace

Axis axisOf(std::uint32_t format, std::uint32_t coordinate, double scale_mm) {
  if (isFloat(format)) return {.invalid = std::nan("")};
  constexpr double kHalf = 32'768.0;
  constexpr std::uint32_t kC = 2;
  return {.scale_mm = scale_mm, .offset_mm = coordinate == kC ? 0.0 : -kHalf * scale_mm};
}

std::uint32_t payloadSizeOf(const ImageSetup& setup) {
  std::uint64_t size = 0;
  for (std::size_t i = 0; i < setup.formats.size(); ++i) {
    if (setup.is_sent[i]) size += std::uint64_t{setup.width} * setup.height * bytesPerPixel(setup.formats[i]);
  }
  if (size > 0 && hasChunks(setup))
    size += 16 * static_cast<std::uint64_t>(std::ranges::count(setup.has_chunk, true)) +
            (setup.is_multipart ? 0 : 8);
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(size, 0xFFFF'FFFF));
}

Rays raysOf(const CameraInfo& camera) {
  return {camera, unitVectorsOf(camera)};
}

Result<Payload> payloadOf(const Frame& frame, const Rays& rays, const ImageSetup& setup,
                          std::int64_t stamp_ns) {
  if (auto checked = check(frame, setup); !checked) return checked.error();
  constexpr std::array<std::uint16_t, Component::kCount> kIds{4, 1, 6}, kTypes{5, 1, 9};
  constexpr std::uint16_t kChunkType = 10;
  Payload payload;
  payload.bytes.reserve(payloadSizeOf(setup));
  for (std::uint32_t i = 0; i < Component::kCount; ++i) {
    if (!setup.is_sent[i]) continue;
    const std::size_t offset = payload.bytes.size(),
                      size = std::size_t{setup.width} * setup.height * bytesPerPixel(setup.formats[i]);
    payload.bytes.resize(offset + size);
    const Cursor to{payload.bytes.data() + offset};
    if (i == Component::kRange) putRange(to, frame, rays, setup);
    if (i == Component::kIntensity) putIntensity(to, frame, setup);
    if (i == Component::kConfidence) putConfidence(to, frame, setup);
    payload.parts.push_back({.component = kIds[i],
                             .data_type = kTypes[i],
                             .format = setup.formats[i],
                             .width = setup.width,
                             .height = setup.height,
                             .x = setup.x,
                             .y = setup.y,
                             .offset = offset,
                             .size = size});
  }
  payload.has_chunks = hasChunks(setup);
  if (!payload.has_chunks) return payload;
  const std::size_t offset = payload.bytes.size();
  appendChunks(payload.bytes, frame, setup, stamp_ns, offset);
  if (setup.is_multipart)
    payload.parts.push_back(
        {.data_type = kChunkType, .offset = offset, .size = payload.bytes.size() - offset});
  return payload;
}

}  // namespace toftwin::daemon::gige_vision
