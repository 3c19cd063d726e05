// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/frame_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "drivers/o3d303/wire/confidence.h"

namespace toftwin::drivers::o3d303 {
namespace {

using toftwin::o3d303::Chunk;
using toftwin::o3d303::ChunkType;
using toftwin::o3d303::FrameContent;

constexpr auto kInvalid = static_cast<unsigned>(PixelFlag::Invalid);

Result<const Chunk*> chunkOf(const FrameContent& content, ChunkType type,
                             const Image<float>& like) {
  const Chunk* chunk = content.find(type);
  if (chunk == nullptr) {
    return Error{Error::Code::Malformed, fmt::format("o3d303: the frame has no chunk {}",
                                                     static_cast<std::uint32_t>(type))};
  }
  if (chunk->header.width != static_cast<unsigned>(like.width()) ||
      chunk->header.height != static_cast<unsigned>(like.height())) {
    return Error{
        Error::Code::Malformed,
        fmt::format("o3d303: chunk {} is {} x {}, the camera had {} x {} when it was opened",
                    static_cast<std::uint32_t>(type), chunk->header.width, chunk->header.height,
                    like.width(), like.height())};
  }
  return chunk;
}

bool hasSeveralExposures(const FrameContent& content) {
  constexpr std::array<std::uint32_t, 3> kNotSaid{};
  const auto& times_us = content.exposures_us.value_or(kNotSaid);
  return std::ranges::count_if(times_us, [](std::uint32_t us) { return us > 0; }) > 1;
}

}  // namespace

Result<std::vector<Plane>> planesOf(const FrameContent& content,
                                    const Image<float>& depth_per_range) {
  const bool is_raw = content.find(ChunkType::RawAmplitude) != nullptr;
  const auto distance = chunkOf(content, ChunkType::RadialDistance, depth_per_range);
  if (!distance) return distance.error();
  const auto amplitude =
      chunkOf(content, is_raw ? ChunkType::RawAmplitude : ChunkType::Amplitude, depth_per_range);
  if (!amplitude) return amplitude.error();
  const auto confidence = chunkOf(content, ChunkType::Confidence, depth_per_range);
  if (!confidence) return confidence.error();
  auto range_m = rangeOf(**distance);
  if (!range_m) return range_m.error();
  auto strength = numbersOf(**amplitude);
  if (!strength) return strength.error();
  auto flags = bytesOf(**confidence);
  if (!flags) return flags.error();
  Image<float> depth_m{range_m->width(), range_m->height()};
  Image<std::uint8_t> exposure{range_m->width(), range_m->height()};
  for (std::size_t i = 0; i < range_m->size(); ++i) {
    exposure[i] = toftwin::o3d303::exposureOf((*flags)[i]);
    unsigned flag = toftwin::o3d303::flagsOf((*flags)[i]);
    // The confidence decides, and a distance of zero is none, whatever it says.
    if (std::isnan((*range_m)[i])) flag |= kInvalid;
    if ((flag & kInvalid) != 0) (*range_m)[i] = std::numeric_limits<float>::quiet_NaN();
    depth_m[i] = (*range_m)[i] * depth_per_range[i];
    (*flags)[i] = static_cast<std::uint8_t>(flag);
  }
  std::vector<Plane> planes;
  planes.push_back(toPlane(PlaneKind::Range, *std::move(range_m)));
  planes.push_back(toPlane(PlaneKind::Depth, std::move(depth_m)));
  planes.push_back(toPlane(PlaneKind::Amplitude, *std::move(strength)));
  planes.push_back(toPlane(PlaneKind::Flags, *std::move(flags)));
  if (hasSeveralExposures(content)) planes.push_back(toPlane(PlaneKind::Exposure, std::move(exposure)));
  return planes;
}

}  // namespace toftwin::drivers::o3d303
