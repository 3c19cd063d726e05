// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>

#include <toftwin/geometry.h>

namespace toftwin {

/// Where a pixel looks. Pinhole with the distortion of OpenCV's `calib3d` (Brown-Conrady, five
/// terms k1 k2 p1 p2 k3). Pixel (0, 0) is the centre of the top left pixel.
///   x = X/Z, y = Y/Z, r² = x² + y²
///   x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2x²)
///   y' = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2y²) + 2 p2 x y
///   u = fx x' + cx, v = fy y' + cy
struct CameraInfo {
  int width = 0;
  int height = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  ///< pixels
  std::array<double, 5> distortion{};             ///< k1 k2 p1 p2 k3
  std::string calibration_id;                     ///< content hash, 32 hex digits, or empty

  bool operator==(const CameraInfo&) const = default;
};

/// The unit ray through pixel coordinates (u, v): inverts the distortion by Newton's method to
/// 1e-12 of the image plane's unit length or 20 steps.
Direction<Camera> rayThroughPixel(const CameraInfo& camera, double u, double v);

/// Pixel coordinates (u, v) of a point with z > 0, distortion applied.
std::array<double, 2> pixelOfPoint(const CameraInfo& camera, Point<Camera> point);

}  // namespace toftwin
