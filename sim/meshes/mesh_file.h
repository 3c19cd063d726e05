// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "sim/meshes/triangle_mesh.h"

/// Files of triangles that other programs wrote. No count, index or length in a file is believed before it was
/// checked against the bytes that are there; what is damaged is an error that says where.
namespace toftwin::sim::meshes {

/// A picture that a mesh file names or holds.
struct Picture {
  std::filesystem::path file;    ///< absolute; empty: it is in `bytes`
  std::vector<std::byte> bytes;  ///< as a PNG or JPEG file would hold them
  [[nodiscard]] bool isThere() const { return !file.empty() || !bytes.empty(); }
};

/// What a file says of a surface, in glTF's words [glTF 2.0, section 3.9.2].
struct Surface {
  std::string name;
  std::array<double, 3> base_color{1.0, 1.0, 1.0};  ///< linear share of red, green and blue that is reflected
  double metallic = 0.0;                            ///< 0: plastic, paint; 1: bare metal
  double roughness = 1.0;                           ///< GGX: alpha is its square
  double index = 1.5;                               ///< refractive, of what is not metal
  Picture picture;                                  ///< multiplies the base colour; coded for screens (sRGB)
};

/// Neighbouring triangles of one surface.
struct Part {
  std::string name;
  std::size_t first = 0, count = 0;    ///< of the mesh's triangles
  std::optional<std::size_t> surface;  ///< index of MeshFile::surfaces
};

struct MeshFile {
  /// In the file's own unit and frame. Where the file gives some triangles places on a picture, the others' are NaN.
  TriangleMesh mesh;
  std::vector<Part> parts;
  std::vector<Surface> surfaces;
  std::vector<std::string> notes;  ///< what was left out, for people
};

struct ReadOptions {
  std::stop_token stop;  ///< ends a long reading soon, with the error Stopped
  /// Whether formats other than PLY, OBJ, STL, glTF and GLB may be read: by Assimp, in a process of its own
  /// that may take bounded memory and time.
  bool may_convert = false;
};

/// Reads a mesh file by what its extension says. Vertices are kept in double precision, polygons are split
/// into triangles, triangles without an area are left out with a note. An unreadable or empty file, an index
/// out of range or a vertex that is not finite is an error that names the file and the place.
Result<MeshFile> readMeshFile(const std::filesystem::path& file, const ReadOptions& options = {});

}  // namespace toftwin::sim::meshes
