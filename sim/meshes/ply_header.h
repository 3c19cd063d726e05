// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::sim::meshes {

enum class PlyType { Int8, Uint8, Int16, Uint16, Int32, Uint32, Float32, Float64 };
std::size_t sizeOf(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type{};
  std::optional<PlyType> count;  ///< of a list: of the number in front of it
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  enum class Format { Text, LittleEndian, BigEndian };
  Format format{};
  std::vector<PlyElement> elements;
  std::size_t size = 0;  ///< where the data begin
};

Result<PlyHeader> readPlyHeader(std::string_view bytes, const std::filesystem::path& file);

}  // namespace toftwin::sim::meshes
