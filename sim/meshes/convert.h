// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <stop_token>

#include "sim/meshes/mesh_file.h"

namespace toftwin::sim::meshes {

/// Reads a file of a format that only Assimp knows (DAE, FBX, 3DS, …) in a child process, whose memory and
/// time are bounded: whatever a damaged file does to it, this process gets an error. Its answer is checked as
/// any file is.
Result<MeshFile> readConverted(const std::filesystem::path& file, const std::stop_token& stop);

}  // namespace toftwin::sim::meshes
