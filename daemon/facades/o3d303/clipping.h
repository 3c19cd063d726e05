// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>

namespace toftwin::daemon::o3d303 {

/// What the camera leaves out of its images: pixels beside a rectangle, and points beside a cuboid in the
/// coordinates of its X, Y and Z images (X right, Y down, Z forward, as the extrinsic calibration puts them).
struct Clipping {
  int left = 0, top = 0, right = 1 << 16, bottom = 1 << 16;  ///< the last ones that stay
  std::array<double, 3> least_m{-1e30, -1e30, -1e30}, most_m{1e30, 1e30, 1e30};

  [[nodiscard]] bool hasPixel(int x, int y) const {
    return x >= left && x <= right && y >= top && y <= bottom;
  }
  [[nodiscard]] bool hasPoint(const std::array<double, 3>& xyz_m) const {
    for (std::size_t i = 0; i < 3; ++i) {
      if (xyz_m[i] < least_m[i] || xyz_m[i] > most_m[i]) return false;
    }
    return true;
  }
  bool operator==(const Clipping&) const = default;
};

/// Puts in what the parameter ClippingCuboid says, JSON with XMin to ZMax in metres, of which any may be
/// missing. False if it is none; any text is safe.
bool readCuboid(const std::string& json, Clipping& clipping);

}  // namespace toftwin::daemon::o3d303
