// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <toftwin/result.h>

#include "drivers/o3d303/wire/chunk.h"
#include "drivers/o3d303/wire/schema.h"

namespace toftwin::o3d303 {

/// One frame as the camera has it, from which each connection gets what its schema asks for. Images
/// have width × height elements, row by row.
struct CameraFrame {
  std::uint32_t width = 176, height = 132;
  std::uint32_t frame_count = 0;
  std::uint32_t status = 0;
  ChunkHeader::Time time{};
  std::uint32_t time_us = 0;
  std::span<const std::uint16_t> distance_mm;  ///< along the ray, 0 where there is none
  std::span<const std::uint16_t> amplitude;    ///< normalised
  std::span<const std::uint16_t> raw_amplitude;
  std::span<const std::uint8_t> confidence;  ///< confidence.h
  std::span<const float> unit_vectors;       ///< three per pixel: x right, y down, z forward
  std::array<float, 6> extrinsics{};         ///< mm, degrees
  std::array<float, 16> intrinsics{}, inverse_intrinsics{};
  std::array<std::uint32_t, 3> exposures_us{};
  float illumination_c = 0.0F;
};

/// The content of a frame's PCIC message. Unsupported if the schema asks for what is not known.
Result<Bytes> writeFrameContent(const Schema& schema, const CameraFrame& frame);

}  // namespace toftwin::o3d303
