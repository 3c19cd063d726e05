// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <vector>

/// Where the optics are seen from, as chunk 400 says it. A point p of an image, in millimetres, is
///   p = e d + t,   e = R e_optics,   R = Rx(rx) Ry(ry) Rz(rz)
/// d: the distance; e: the unit vector that the camera sends, already rotated; e_optics: the pixel's ray
/// through the lens. Both frames: x right, y down, z forward. [ifm3d 0.20.3, OpenCV.ComputeCartesian;
/// libo3d3xx 0.7.7, ImageBuffers_Tests.Extrinsics]
namespace toftwin::o3d303 {

/// tx ty tz in millimetres, rx ry rz in degrees.
using ExtrinsicCalibration = std::array<float, 6>;

/// Rays through the lens, three numbers per pixel, become the unit vectors that the camera sends. Without a
/// rotation they keep every bit.
std::vector<float> unitVectorsFrom(std::span<const float> rays, const ExtrinsicCalibration& extrinsics);
/// The other way round.
std::vector<float> raysFrom(std::span<const float> unit_vectors, const ExtrinsicCalibration& extrinsics);

}  // namespace toftwin::o3d303
