// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

#include "sim/meshes/mesh_file.h"

/// A reader for each format: `file` names it in errors and starts relative paths, `bytes` are its content.
namespace toftwin::sim::meshes {

/// Polygon File Format 1.0, ASCII or binary, with any further elements and properties (G. Turk, 1994).
Result<MeshFile> readPly(std::string_view bytes, const std::filesystem::path& file, const std::stop_token& stop);

/// Wavefront OBJ: polygons and their texture coordinates. Lines, points and free-form curves are left out.
Result<MeshFile> readObj(std::string_view bytes, const std::filesystem::path& file, const std::stop_token& stop);

/// STL, ASCII or binary (3D Systems, 1988).
Result<MeshFile> readStl(std::string_view bytes, const std::filesystem::path& file, const std::stop_token& stop);

/// glTF 2.0 as JSON or GLB, in the pose that its nodes give; a part for each primitive of a node, by its name.
Result<MeshFile> readGltf(std::string_view bytes, const std::filesystem::path& file, const std::stop_token& stop);

}  // namespace toftwin::sim::meshes
