// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "daemon/facades/o3r/device.h"
#include "drivers/o3r/wire/head_frame.h"

namespace toftwin::daemon::o3r {

/// How a camera's pixels look, in the forms in which a head tells it.
struct LensModels {
  CameraInfo camera;
  toftwin::o3r::LensModel intrinsics{};          ///< model 0, fitted where there is distortion
  toftwin::o3r::LensModel inverse_intrinsics{};  ///< model 1
};
LensModels lensModelsOf(const CameraInfo& camera);

/// What the facade's keys say of every frame.
struct Scales {
  double electrons_per_count = 6.0;
  float distance_resolution_m = 0.0F;
  int jpeg_quality = 90;
};

/// A frame as a head sends it; `wire` refers to the images beside it.
struct HeadImages {
  std::vector<std::uint16_t> distance{}, amplitude{}, confidence{};
  std::vector<std::byte> jpeg{};
  toftwin::o3r::HeadFrame wire{};
};

/// Of a 3D head (docs/facades/o3r.md):
///   distance = round(range / resolution), 0 where there is none
///   amplitude = 1 + round(√(amplitude / (electrons_per_count · exposure / µs) / resolution))
///   confidence: the flags in the head's bits, and which exposure a pixel is of
/// Unsupported: the frame has neither range nor depth.
Result<HeadImages> images3d(const Frame& frame, const LensModels& lens, const Scales& scales,
                            const HeadSettings& settings);
/// Of a 2D head: the colour image as a JPEG. Unsupported: the frame has none, or it cannot be written.
Result<HeadImages> images2d(const Frame& frame, const LensModels& lens, const Scales& scales,
                            const HeadSettings& settings);
/// What ALGO_DEBUG holds, whose form is the maker's own and not public: here it is JSON of ours.
std::vector<std::byte> algorithmMessage(const HeadImages& images);

}  // namespace toftwin::daemon::o3r
