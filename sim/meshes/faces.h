// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <vector>

#include "sim/meshes/mesh_file.h"

namespace toftwin::sim::meshes {

/// Polygons as a file gives them, not checked yet.
struct Faces {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  std::vector<Vec3d> vertices;
  std::vector<TexturePlace> places;
  std::vector<std::uint32_t> corners;        ///< indices of vertices, of all faces one after another
  std::vector<std::uint32_t> corner_places;  ///< indices of places, of each corner, or kNone; empty: of none
  std::vector<std::uint64_t> ends;           ///< of each face, behind its last corner
};

/// The triangles of the faces, once all was checked: every vertex is finite and every index is below the
/// number of what it counts. Errors name the first place that is wrong.
Result<MeshFile> meshOf(Faces faces, const std::filesystem::path& file, const std::stop_token& stop);

/// Leaves triangles without an area out, with a note; an error if nothing is left. Parts are kept in step.
Result<> leaveOutFlat(MeshFile& read, const std::filesystem::path& file);

/// InvalidArgument for a vertex that is not finite, or so far away that its square cannot be reckoned with.
Result<> checkVertices(const std::vector<Vec3d>& vertices, const std::filesystem::path& file);

Error damaged(const std::filesystem::path& file, std::string_view what);
Error askedToStop();

}  // namespace toftwin::sim::meshes
