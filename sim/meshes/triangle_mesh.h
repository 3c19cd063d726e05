// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <toftwin/geometry.h>

namespace toftwin::sim {

/// A place on a picture: (0, 0) is its top left corner, (1, 1) its bottom right one.
struct TexturePlace {
  float u = 0.0f, v = 0.0f;
};

struct TriangleMesh {
  std::vector<Vec3d> vertices;                          ///< metres, unless it is said otherwise
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of vertices, all below their number
  /// Where each triangle's corners lie on a picture; empty if the file does not say it of all.
  std::vector<std::array<TexturePlace, 3>> places;
};

}  // namespace toftwin::sim
