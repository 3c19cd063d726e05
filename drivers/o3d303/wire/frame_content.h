// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <toftwin/image.h>
#include <toftwin/result.h>

#include "drivers/o3d303/wire/chunk.h"

/// What is between the ticket and the line end of a frame's PCIC message:
///   "star"  chunks, texts and numbers as the schema asks for them  "stop"
namespace toftwin::o3d303 {

struct FrameContent {
  std::vector<Chunk> chunks;  ///< as they lie in the bytes that were read
  std::optional<std::array<std::uint32_t, 3>> exposures_us;  ///< 0: not used
  std::optional<float> illumination_c;

  /// The first chunk of that type, or null.
  [[nodiscard]] const Chunk* find(ChunkType type) const;
};

/// Any bytes are safe; what is no such frame is Malformed.
Result<FrameContent> readFrameContent(std::span<const std::byte> content);

/// Markers by which the numbers after them are known.
inline constexpr std::string_view kFrameBegin = "star", kFrameEnd = "stop";
inline constexpr std::string_view kExposuresMarker = "extime", kIlluminationMarker = "temp_illu";

/// Radial distance in metres, NaN where the chunk's number is zero: integers count in millimetres
/// (or as the attributes say), floats in metres.
Result<Image<float>> rangeOf(const Chunk& chunk);
/// Numbers as they are.
Result<Image<float>> numbersOf(const Chunk& chunk);
Result<Image<std::uint8_t>> bytesOf(const Chunk& chunk);
/// All floats of the chunk: extrinsics, intrinsics, unit vectors.
Result<std::vector<float>> floatsOf(const Chunk& chunk);

}  // namespace toftwin::o3d303
