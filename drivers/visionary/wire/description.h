// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include <toftwin/result.h>

/// The XML that a blob begins with: what camera it is, and how its images lie.
/// [SICKAG/sick_visionary_cpp_base 1.1.0]
namespace toftwin::visionary {

struct Description {
  int width = 0, height = 0;
  /// Row by row; the last column is in millimetres.
  std::array<double, 16> camera_to_world{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  /// Of a Visionary-T Mini the focal lengths are negative: with its clients' x = (cx - column) / fx, x is
  /// right and y down.
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;
  double k1 = 0.0, k2 = 0.0, p1 = 0.0, p2 = 0.0, k3 = 0.0;
  double focal_to_ray_cross_mm = 0.0;
  /// Bytes of one pixel; 0: there is no such image.
  std::size_t distance_bytes = 2, intensity_bytes = 2, state_bytes = 2;
  std::string ident{}, version{}, serial{}, address{};
  bool operator==(const Description&) const = default;
};

std::string toXml(const Description& description);
/// Any text is safe. Malformed: it is no such description, or its images have no size.
Result<Description> readDescription(std::string_view xml);

}  // namespace toftwin::visionary
