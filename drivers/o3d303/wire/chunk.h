// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "drivers/o3d303/wire/bytes.h"

namespace toftwin::o3d303 {

/// What a chunk holds; the numbers are those on the wire. Others exist and are passed over.
enum class ChunkType : std::uint32_t {
  RadialDistance = 100,
  Amplitude = 101,  ///< normalised by exposure, if the camera is set to
  RawAmplitude = 103,
  DistanceNoise = 105,
  X = 200,  ///< X right, Y down and Z forward, in millimetres: extrinsics.h
  Y = 201,
  Z = 202,
  UnitVectors = 223,  ///< per pixel: x right, y down, z forward, rotated as extrinsics.h says
  Confidence = 300,
  Diagnostic = 302,
  Extrinsics = 400,  ///< tx ty tz in millimetres, rx ry rz in degrees
  Intrinsics = 401,
  InverseIntrinsics = 402,
  Json = 500,
};

enum class ElementFormat : std::uint32_t {
  U8 = 0,
  S8 = 1,
  U16 = 2,
  S16 = 3,
  U32 = 4,
  S32 = 5,
  F32 = 6,
  U64 = 7,
  F64 = 8,
  U16x2 = 9,
  F32x3 = 10
};
/// 0 for a number that is no format.
std::size_t sizeOf(ElementFormat format);

struct ChunkHeader {
  ChunkType type = ChunkType::RadialDistance;
  std::uint32_t width = 0, height = 0;  ///< at most 8192 each
  ElementFormat format = ElementFormat::U16;
  std::uint32_t time_us = 0;  ///< wraps around after 71.6 minutes
  std::uint32_t frame_count = 0;
  std::uint32_t status = 0;
  struct Time {
    std::uint32_t seconds = 0, nanoseconds = 0;
  };
  std::optional<Time> time{};  ///< from header version 2 on
  std::string attributes{};    ///< JSON, from header version 3 on
};

/// A chunk where it lies: whoever holds it keeps the bytes alive.
struct Chunk {
  ChunkHeader header;
  std::span<const std::byte> data;  ///< at least width × height elements
};

/// The chunk at the beginning of `bytes`, and by `size` how much of them it takes. Header versions
/// 1 (no seconds), 2 and 3 (attributes) are understood.
struct ChunkInBytes {
  Chunk chunk;
  std::size_t size = 0;
};
Result<ChunkInBytes> readChunk(std::span<const std::byte> bytes);

/// Appends a chunk with a header of version 2 (3 if there are attributes).
void appendChunk(Bytes& bytes, const ChunkHeader& header, std::span<const std::byte> data);

/// Of the attributes: metres per unit of distance, nothing if they do not say.
std::optional<double> distanceResolution(const ChunkHeader& header);

}  // namespace toftwin::o3d303
