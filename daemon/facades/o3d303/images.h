// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "daemon/facades/o3d303/clipping.h"
#include "drivers/o3d303/wire/frame_writer.h"

namespace toftwin::daemon::o3d303 {

/// A frame as the camera sends it. Images have their own memory here, `wire` refers to it.
struct CameraImages {
  std::vector<std::uint16_t> distance_mm, amplitude;
  std::vector<std::uint8_t> confidence;
  toftwin::o3d303::CameraFrame wire;
};

/// What the camera's parameters tell of a frame.
struct FrameFacts {
  std::vector<std::uint32_t> exposures_us;  ///< the different ones, shortest first, at most three
  int frequencies = 1;                      ///< one to three
  std::optional<double> illumination_c, housing_c, processor_c;
};
FrameFacts factsOf(const Frame& frame);

/// Where the pixels of a camera look, in the forms in which this one tells it.
struct LensChunks {
  CameraInfo camera;
  toftwin::o3d303::ExtrinsicCalibration extrinsics{};
  std::vector<float> rays{};          ///< through the lens, three numbers per pixel
  std::vector<float> unit_vectors{};  ///< the same as the extrinsics rotate them
  std::array<float, 16> intrinsics{}, inverse_intrinsics{};
};
LensChunks lensChunksOf(const CameraInfo& camera, const toftwin::o3d303::ExtrinsicCalibration& extrinsics);

/// The camera's unit conversion (docs/facades/o3d303.md):
///   distance = round(1000 range / m), 0 where there is none or beyond 65535
///   amplitude = round(amplitude / electrons_per_count), at most 65535
///   confidence: the flags in the camera's bits, and which exposure a pixel is of
/// `lens` must be of the frame's camera and outlive the result. Unsupported: the frame has neither range nor
/// depth.
Result<CameraImages> imagesOf(const Frame& frame, const LensChunks& lens, double electrons_per_count);

/// What lies beside the clipping becomes invalid, and clipped in the confidence. Points are those of the X, Y
/// and Z images.
void clip(const Clipping& clipping, CameraImages& images);

}  // namespace toftwin::daemon::o3d303
