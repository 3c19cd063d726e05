// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <toftwin/result.h>

#include "drivers/o3d303/wire/chunk.h"
#include "drivers/o3d303/wire/extrinsics.h"
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
  std::span<const float> unit_vectors;       ///< three per pixel, rotated as extrinsics.h says
  ExtrinsicCalibration extrinsics{};
  std::array<float, 16> intrinsics{}, inverse_intrinsics{};
  std::array<std::uint32_t, 3> exposures_us{};
  static constexpr float kNoSensor_c = 3276.7F;  ///< what the camera says of a temperature that it lacks
  float illumination_c = kNoSensor_c, front1_c = kNoSensor_c, front2_c = kNoSensor_c,
        processor_c = kNoSensor_c;
  double evaluation_ms = 0.0, frame_rate_hz = 0.0;
  int active_application = 0;
};

/// The content of a frame's PCIC message. Unsupported if the schema asks for what is not known.
Result<Bytes> writeFrameContent(const Schema& schema, const CameraFrame& frame);

}  // namespace toftwin::o3d303
