// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/wire/frame_content.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace toftwin::o3d303 {
namespace {

constexpr std::size_t kMostChunks = 64;
constexpr float kMetresPerMillimetre = 1e-3F;

Error malformedFrame(std::string what) { return {Error::Code::Malformed, "frame: " + std::move(what)}; }

/// Width times height, if the image has pixels and the data has as many elements.
Result<std::size_t> pixelsOf(const Chunk& chunk) {
  const auto& [header, data] = chunk;
  const std::size_t pixels = std::size_t{header.width} * header.height;
  if (pixels == 0 || data.size() / sizeOf(header.format) < pixels) {
    return malformedFrame(fmt::format("chunk {}: {} bytes do not hold {} x {} elements of {} bytes",
                                      static_cast<std::uint32_t>(header.type), data.size(), header.width,
                                      header.height, sizeOf(header.format)));
  }
  return pixels;
}

Error unexpectedFormat(const Chunk& chunk) {
  return malformedFrame(fmt::format("chunk {} has elements of format {}, which it cannot have",
                                    static_cast<std::uint32_t>(chunk.header.type),
                                    static_cast<std::uint32_t>(chunk.header.format)));
}

template <class T>
void copyNumbers(const Chunk& chunk, Image<float>& to) {
  for (std::size_t i = 0; i < to.size(); ++i) {
    to[i] = static_cast<float>(numberAt<T>(chunk.data, i * sizeof(T)));
  }
}

/// Reads the numbers after a marker, if the marker is next.
template <class Numbers>
Result<bool> readMarked(std::string_view marker, std::span<const std::byte>& rest,
                        std::optional<Numbers>& numbers) {
  if (!textOf(rest).starts_with(marker)) return false;
  if (rest.size() < marker.size() + sizeof(Numbers)) {
    return malformedFrame(fmt::format("no number after \"{}\"", marker));
  }
  numbers = numberAt<Numbers>(rest, marker.size());
  rest = rest.subspan(marker.size() + sizeof(Numbers));
  return true;
}

}  // namespace

const Chunk* FrameContent::find(ChunkType type) const {
  const auto found =
      std::ranges::find_if(chunks, [&](const Chunk& chunk) { return chunk.header.type == type; });
  return found == chunks.end() ? nullptr : &*found;
}

Result<FrameContent> readFrameContent(std::span<const std::byte> content) {
  FrameContent frame;
  if (!textOf(content).starts_with(kFrameBegin)) return malformedFrame("it does not begin with \"star\"");
  auto rest = content.subspan(kFrameBegin.size());
  while (textOf(rest) != kFrameEnd) {
    const auto exposures = readMarked(kExposuresMarker, rest, frame.exposures_us);
    if (!exposures) return exposures.error();
    const auto illumination = readMarked(kIlluminationMarker, rest, frame.illumination_c);
    if (!illumination) return illumination.error();
    if (*exposures || *illumination) continue;
    auto read = readChunk(rest);
    if (!read) return malformedFrame("not \"stop\", nor a whole chunk: " + read.error().message);
    if (frame.chunks.size() == kMostChunks) return malformedFrame("too many chunks");
    rest = rest.subspan(read->size);
    frame.chunks.push_back(std::move(read->chunk));
  }
  return frame;
}

Result<Image<float>> rangeOf(const Chunk& chunk) {
  auto image = numbersOf(chunk);
  if (!image) return image;
  const bool is_metres = chunk.header.format == ElementFormat::F32;
  const float unit_m =
      is_metres
          ? 1.0F
          : static_cast<float>(distanceResolution(chunk.header).value_or(kMetresPerMillimetre));
  for (float& range_m : image->pixels()) {
    const bool has_value = std::isfinite(range_m) && range_m > 0.0F;
    range_m = has_value ? range_m * unit_m : std::numeric_limits<float>::quiet_NaN();
  }
  return image;
}

Result<Image<float>> numbersOf(const Chunk& chunk) {
  if (const auto pixels = pixelsOf(chunk); !pixels) return pixels.error();
  Image<float> image{static_cast<int>(chunk.header.width), static_cast<int>(chunk.header.height)};
  switch (chunk.header.format) {
    case ElementFormat::U8:
      copyNumbers<std::uint8_t>(chunk, image);
      break;
    case ElementFormat::U16:
      copyNumbers<std::uint16_t>(chunk, image);
      break;
    case ElementFormat::S16:
      copyNumbers<std::int16_t>(chunk, image);
      break;
    case ElementFormat::U32:
      copyNumbers<std::uint32_t>(chunk, image);
      break;
    case ElementFormat::F32:
      copyNumbers<float>(chunk, image);
      break;
    default:
      return unexpectedFormat(chunk);
  }
  return image;
}

Result<Image<std::uint8_t>> bytesOf(const Chunk& chunk) {
  const auto pixels = pixelsOf(chunk);
  if (!pixels) return pixels.error();
  if (chunk.header.format != ElementFormat::U8) return unexpectedFormat(chunk);
  Image<std::uint8_t> image{static_cast<int>(chunk.header.width),
                            static_cast<int>(chunk.header.height)};
  std::memcpy(image.pixels().data(), chunk.data.data(), *pixels);
  return image;
}

Result<std::vector<float>> floatsOf(const Chunk& chunk) {
  if (chunk.header.format != ElementFormat::F32 && chunk.header.format != ElementFormat::F32x3) {
    return unexpectedFormat(chunk);
  }
  std::vector<float> floats(chunk.data.size() / sizeof(float));
  if (!floats.empty()) {
    std::memcpy(floats.data(), chunk.data.data(), floats.size() * sizeof(float));
  }
  return floats;
}

}  // namespace toftwin::o3d303
