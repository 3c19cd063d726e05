// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3r/frame_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "drivers/lens.h"
#include "drivers/o3d303/wire/confidence.h"
#include "drivers/o3r/wire/confidence.h"
#include "drivers/o3r/wire/head_frame.h"
#include "drivers/o3r/wire/numbers.h"
#include "drivers/ray_fit.h"

namespace toftwin::drivers::o3r {
namespace {

using toftwin::o3d303::Chunk;
using toftwin::o3d303::ChunkType;
using toftwin::o3d303::ElementFormat;
using toftwin::o3d303::FrameContent;
using toftwin::o3r::TofInfo;

constexpr auto kInvalidFlag = static_cast<unsigned>(PixelFlag::Invalid);

/// Copied, because chunks lie anywhere; a byte each of older firmware's confidence.
Result<std::vector<std::uint16_t>> countsOf(const FrameContent& content, ChunkType type,
                                            const Image<float>& like) {
  const Chunk* chunk = content.find(type);
  const auto pixels = like.size();
  const bool is_small = chunk != nullptr && chunk->header.format == ElementFormat::U8;
  const bool is_image = chunk != nullptr && chunk->header.width == static_cast<unsigned>(like.width()) &&
                        chunk->header.height == static_cast<unsigned>(like.height()) &&
                        (is_small || chunk->header.format == ElementFormat::U16) &&
                        chunk->data.size() >= pixels * sizeOf(chunk->header.format);
  if (!is_image) {
    return Error{Error::Code::Malformed,
                 fmt::format("o3r: the frame has no chunk {} of {} x {} pixels",
                             static_cast<std::uint32_t>(type), like.width(), like.height())};
  }
  std::vector<std::uint16_t> counts(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    counts[i] = is_small ? std::to_integer<std::uint16_t>(chunk->data[i])
                         : toftwin::o3d303::numberAt<std::uint16_t>(chunk->data, 2 * i);
  }
  return counts;
}

/// Exposure times in seconds, the longest first, of those that are.
std::vector<float> exposuresOf(const TofInfo& info) {
  std::vector<float> exposures;
  for (const float one : info.exposures_s) {
    if (one > 0.0F) exposures.push_back(one);
  }
  std::ranges::sort(exposures, std::greater{});
  return exposures;
}

bool isFinite(const toftwin::o3r::LensModel& lens) {
  return std::ranges::all_of(lens.parameters, [](float one) { return std::isfinite(one); });
}

std::vector<float> raysOf(const TofInfo& info, int width, int height) {
  std::vector<float> rays;
  rays.reserve(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      for (const float one : toftwin::o3r::rayOf(info.intrinsics, u, v)) rays.push_back(one);
    }
  }
  return rays;
}

}  // namespace

Result<TofInfo> infoOf(const FrameContent& content) {
  const Chunk* chunk = content.find(toftwin::o3r::ChunkTypes::kTofInfo);
  if (chunk == nullptr) return Error{Error::Code::Malformed, "o3r: the frame has no TOF_INFO"};
  auto info = toftwin::o3r::readTofInfo(chunk->data);
  if (info && !(info->distance_resolution_m > 0.0F && info->distance_resolution_m < 1.0F))
    return Error{Error::Code::Malformed, "o3r: the distance resolution in TOF_INFO is none"};
  return info;
}

Result<Optics> opticsOf(const TofInfo& info, int width, int height) {
  const auto& p = info.inverse_intrinsics.parameters;
  if (!isFinite(info.intrinsics) || !isFinite(info.inverse_intrinsics))
    return Error{Error::Code::Incompatible, "o3r: the head's lens models are no numbers"};
  constexpr double kHalf = 0.5;  // their first pixel's middle is (0.5, 0.5)
  const bool is_ours = info.inverse_intrinsics.model == 1 && p[0] > 0.0F && p[1] > 0.0F && p[4] == 0.0F;
  if (is_ours) {
    const auto number = [&](std::size_t i) { return static_cast<double>(p[i]); };
    const CameraInfo camera{.width = width,
                            .height = height,
                            .fx = number(0),
                            .fy = number(1),
                            .cx = number(2) - kHalf,
                            .cy = number(3) - kHalf,
                            .distortion = {number(5), number(6), number(7), number(8), number(9)},
                            .calibration_id = {}};
    return Optics{camera, depthPerRange(camera)};
  }
  const std::vector<float> rays = raysOf(info, width, height);
  const auto fitted = fitCamera(width, height, rays);
  if (!fitted) return Error{fitted.error().code, "o3r: " + fitted.error().message};
  Optics optics{fitted->camera, Image<float>{width, height}};
  for (std::size_t i = 0; i < optics.depth_per_range.size(); ++i) optics.depth_per_range[i] = rays[3 * i + 2];
  return optics;
}

Result<std::vector<Plane>> planesOf(const FrameContent& content, const TofInfo& info, const Optics& optics) {
  const Image<float>& per_range = optics.depth_per_range;
  const auto distance = countsOf(content, ChunkType::RadialDistance, per_range);
  if (!distance) return distance.error();
  const auto amplitude = countsOf(content, ChunkType::Amplitude, per_range);
  if (!amplitude) return amplitude.error();
  const auto confidence = countsOf(content, ChunkType::Confidence, per_range);
  if (!confidence) return confidence.error();
  const auto size = [&] { return std::pair{per_range.width(), per_range.height()}; }();
  Image<float> range_m{size.first, size.second}, depth_m{size.first, size.second},
      strength{size.first, size.second};
  Image<std::uint8_t> flags{size.first, size.second}, exposure{size.first, size.second};
  for (std::size_t i = 0; i < per_range.size(); ++i) {
    unsigned flag = toftwin::o3r::flagsOf((*confidence)[i]);
    if ((*distance)[i] == 0) flag |= kInvalidFlag;
    const bool is_valid = (flag & kInvalidFlag) == 0;
    range_m[i] = is_valid ? toftwin::o3r::metresOf((*distance)[i], info.distance_resolution_m)
                          : std::numeric_limits<float>::quiet_NaN();
    depth_m[i] = range_m[i] * per_range[i];
    strength[i] = toftwin::o3r::amplitudeOf((*amplitude)[i], info.amplitude_resolution);
    if (strength[i] < 0.0F) strength[i] = std::numeric_limits<float>::quiet_NaN();
    flags[i] = static_cast<std::uint8_t>(flag);
    exposure[i] = toftwin::o3d303::exposureOf(static_cast<std::uint8_t>((*confidence)[i] & 0xFFU));
  }
  std::vector<Plane> planes;
  planes.push_back(toPlane(PlaneKind::Range, std::move(range_m)));
  planes.push_back(toPlane(PlaneKind::Depth, std::move(depth_m)));
  planes.push_back(toPlane(PlaneKind::Amplitude, std::move(strength)));
  planes.push_back(toPlane(PlaneKind::Flags, std::move(flags)));
  if (exposuresOf(info).size() > 1) planes.push_back(toPlane(PlaneKind::Exposure, std::move(exposure)));
  return planes;
}

}  // namespace toftwin::drivers::o3r
