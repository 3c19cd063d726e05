// SPDX-License-Identifier: Apache-2.0
#include "sim/meshes/file_bytes.h"

#include <fmt/format.h>

#include <fstream>

namespace toftwin::sim::meshes {

Result<std::string> bytesOf(const std::filesystem::path& file, std::uint64_t most) {
  std::error_code fault;
  if (std::filesystem::is_directory(file, fault)) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("mesh {}: it is a folder; name the file in it", file.string())};
  }
  if (!std::filesystem::exists(file, fault)) {
    return Error{Error::Code::NotFound,
                 fmt::format("mesh {}: no such file; paths are relative to the scene file", file.string())};
  }
  if (!std::filesystem::is_regular_file(file, fault)) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("mesh {}: it is a device or a pipe, not a file", file.string())};
  }
  const std::uint64_t size = std::filesystem::file_size(file, fault);
  if (!fault && size > most) {
    return Error{Error::Code::TooLarge, fmt::format("mesh {}: it has {} bytes, and {} are the most that are read",
                                                    file.string(), size, most)};
  }
  std::ifstream in{file, std::ios::binary};
  std::string bytes(fault ? 0 : static_cast<std::size_t>(size), '\0');
  if (in) in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (fault || !in.is_open() || in.gcount() != static_cast<std::streamsize>(bytes.size())) {
    return Error{Error::Code::PermissionDenied, fmt::format("mesh {}: it cannot be read", file.string())};
  }
  return bytes;
}

}  // namespace toftwin::sim::meshes
