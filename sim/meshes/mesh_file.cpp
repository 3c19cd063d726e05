// SPDX-License-Identifier: Apache-2.0
#include "sim/meshes/mesh_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "sim/meshes/convert.h"
#include "sim/meshes/file_bytes.h"
#include "sim/meshes/formats.h"

namespace toftwin::sim::meshes {
namespace {

std::string lowercaseExtension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

using Reader = Result<MeshFile> (*)(std::string_view, const std::filesystem::path&, const std::stop_token&);

Reader readerFor(const std::string& extension) {
  if (extension == ".ply") return &readPly;
  if (extension == ".obj") return &readObj;
  if (extension == ".stl") return &readStl;
  if (extension == ".gltf" || extension == ".glb") return &readGltf;
  return nullptr;
}

}  // namespace

Result<MeshFile> readMeshFile(const std::filesystem::path& file, const ReadOptions& options) {
  const Reader reader = readerFor(lowercaseExtension(file));
  if (reader == nullptr) {
    if (auto there = bytesOf(file); !there) return there.error();
    if (options.may_convert) return readConverted(file, options.stop);
    return Error{Error::Code::Unsupported,
                 fmt::format("mesh {}: OBJ, PLY, STL, glTF and GLB can be read; other formats only where "
                             "convert_meshes = true allows a program of its own to convert them",
                             file.string())};
  }
  const auto bytes = bytesOf(file);
  if (!bytes) return bytes.error();
  return reader(*bytes, file, options.stop);
}

}  // namespace toftwin::sim::meshes
