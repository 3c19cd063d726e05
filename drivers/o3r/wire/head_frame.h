// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include <toftwin/result.h>

#include "drivers/o3d303/wire/chunk.h"
#include "drivers/o3d303/wire/schema.h"
#include "drivers/o3r/wire/head_info.h"

namespace toftwin::o3r {

/// What a head can be asked for by a schema.
inline constexpr std::string_view kDistanceBlob = "RADIAL_DISTANCE_COMPRESSED",
                                  kAmplitudeBlob = "AMPLITUDE_COMPRESSED", kConfidenceBlob = "CONFIDENCE",
                                  kTofInfoBlob = "TOF_INFO", kJpegBlob = "JPEG_IMAGE",
                                  kRgbInfoBlob = "RGB_INFO", kIntrinsicsBlob = "intrinsic_calibration",
                                  kInverseIntrinsicsBlob = "inverse_intrinsic_calibration";

/// Chunks beside those of an O3D303.
struct ChunkTypes {
  using Type = toftwin::o3d303::ChunkType;
  static constexpr Type kJpeg{260}, kTofInfo{420}, kRgbInfo{421}, kAlgorithm{900};
};

/// One frame as a head has it, from which each connection gets what its schema asks for. What it does not
/// have is empty. Images have width × height elements, row by row.
struct HeadFrame {
  std::uint32_t width = 0, height = 0, frame_count = 0;
  toftwin::o3d303::ChunkHeader::Time time{};
  std::uint32_t time_us = 0;
  std::span<const std::uint16_t> distance, amplitude;  ///< numbers.h
  std::span<const std::uint16_t> confidence;           ///< confidence.h
  std::optional<TofInfo> tof_info;
  std::span<const std::byte> jpeg;
  std::optional<RgbInfo> rgb_info;
};

/// Star, the blobs, stop.
toftwin::o3d303::Schema schemaOf(std::initializer_list<std::string_view> blobs);
/// The content of a frame's PCIC message. A blob that heads have and this frame does not is left out;
/// Unsupported if the schema asks for what no head has.
Result<Bytes> writeHeadFrame(const toftwin::o3d303::Schema& schema, const HeadFrame& frame);
/// A chunk of bytes that are no image.
void appendBytesChunk(Bytes& to, toftwin::o3d303::ChunkType type, const HeadFrame& frame,
                      std::span<const std::byte> bytes);

}  // namespace toftwin::o3r
