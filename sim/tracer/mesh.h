// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include <toftwin/geometry.h>
#include <toftwin/result.h>

#include "sim/tracer/texture.h"

namespace toftwin::sim {

struct TriangleMesh {
  std::vector<Vec3d> vertices;                          ///< metres
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of vertices, all below their number
  /// Where each triangle's corners lie on a picture; empty if the file does not say it of all.
  std::vector<std::array<TexturePlace, 3>> places;
};

/// Reads all triangles of an OBJ, PLY, glTF or GLB file, with the file's own node transforms applied.
/// Polygons are split into triangles, points and lines ignored. An unreadable or empty file, an index
/// out of range or a vertex that is not finite is an error that names file and vertex.
Result<TriangleMesh> loadMesh(const std::filesystem::path& file);

/// A rectangle in z = 0 and a box, centred at the origin. A picture on the rectangle stands upright and is
/// not mirrored for a viewer at −z with x to the right and y down; each side of the box shows it once.
TriangleMesh rectangleMesh(double size_x, double size_y);
TriangleMesh boxMesh(double size_x, double size_y, double size_z);

}  // namespace toftwin::sim
