// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <toftwin/camera_info.h>
#include <toftwin/result.h>

#include "drivers/o3d303/wire/bytes.h"

/// What an O3R's head says of a frame beside its images: the chunks TOF_INFO and RGB_INFO.
/// [ifm3d 2.0.6, modules/deserialize]
namespace toftwin::o3r {

using toftwin::o3d303::Bytes;

/// How pixels and rays are tied. Parameters of models 0 and 1: fx fy mx my alpha k1 k2 k3 k4 k5, the middle
/// of the first pixel at (0.5, 0.5). Model 0 gives the ray (x, y, 1) of a pixel, with
///   c = ((u + 0.5 - mx) / fx - alpha c_y, (v + 0.5 - my) / fy),  r² = c_x² + c_y²
///   x = c_x (1 + k1 r² + k2 r⁴ + k5 r⁶) + 2 k3 c_x c_y + k4 (r² + 2 c_x²), y likewise.
/// Model 1 has the same form from rays to pixels. Model 2 is a fish-eye: parameters 5 to 8 are k1 to k4 and 9
/// is the greatest angle.
struct LensModel {
  std::uint32_t model = 0;
  std::array<float, 32> parameters{};
  bool operator==(const LensModel&) const = default;
};
/// x y z of the ray through that pixel, of length 1, as the maker's client works it out, in float. Zeros for
/// a model that is not known.
std::array<float, 3> rayOf(const LensModel& lens, int u, int v);
/// Model 1 of our camera, whose distortion goes from rays to pixels.
LensModel inverseModelOf(const CameraInfo& camera);

/// Metres and radians; the rotation is Rx Ry Rz, as of an O3D303.
struct OpticToUser {
  std::array<float, 3> translation_m{}, rotation_rad{};
  bool operator==(const OpticToUser&) const = default;
};
/// R of it, row by row.
std::array<float, 9> rotationOf(const OpticToUser& pose);

struct TofInfo {
  static constexpr std::uint32_t kVersion = 4;
  std::uint32_t version = kVersion;
  float distance_resolution_m = 0.0F, amplitude_resolution = 0.0F;
  std::array<float, 3>
      amplitude_factors{};  ///< by which amplitudes were multiplied, the shortest exposure first
  OpticToUser optic_to_user{};
  LensModel intrinsics{}, inverse_intrinsics{};
  std::array<std::uint64_t, 3> exposure_starts_ns{};
  std::array<float, 3> exposures_s{};
  float illumination_c = 0.0F;          ///< from version 3 on
  std::string mode{}, imager{};         ///< likewise; at most 32 bytes
  std::uint32_t measurement_block = 0;  ///< from version 4 on
  float least_range_m = 0.0F, most_range_m = 0.0F;
};
Bytes encode(const TofInfo& info);
/// Any bytes are safe. Versions 1 to 4 and later ones are read as far as they are known here.
Result<TofInfo> readTofInfo(std::span<const std::byte> bytes);

struct RgbInfo {
  std::uint32_t version = 1, frame_count = 0;
  std::uint64_t start_ns = 0;
  float exposure_s = 0.0F;
  OpticToUser optic_to_user{};
  LensModel intrinsics{}, inverse_intrinsics{};
};
Bytes encode(const RgbInfo& info);
Result<RgbInfo> readRgbInfo(std::span<const std::byte> bytes);
/// As a chunk of its own has it.
Bytes encode(const LensModel& lens);

}  // namespace toftwin::o3r
