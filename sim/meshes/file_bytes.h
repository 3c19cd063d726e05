// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include <toftwin/result.h>

namespace toftwin::sim::meshes {

/// The most that a file of triangles may hold: 80 million of a binary PLY.
inline constexpr std::uint64_t kMostFileBytes = 2ull << 30;

/// All bytes of a regular file; a pipe, a device or a folder is an error, as is one with more than `most`.
Result<std::string> bytesOf(const std::filesystem::path& file, std::uint64_t most = kMostFileBytes);

}  // namespace toftwin::sim::meshes
