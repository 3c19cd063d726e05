// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include <toftwin/result.h>

namespace tinygltf {
class Model;
}

namespace toftwin::sim::meshes {

/// An accessor's values, all of which lie in its buffer.
class GltfValues {
 public:
  /// Malformed unless the accessor has that many components and lies within its view, and that within its buffer.
  static Result<GltfValues> of(const tinygltf::Model& model, int accessor, int components, const std::filesystem::path& file);

  [[nodiscard]] std::size_t count() const { return count_; }
  /// A component of a value; of an integer that is normalised, 0 to 1 or −1 to 1 [glTF 2.0, section 3.6.2.2].
  [[nodiscard]] double at(std::size_t value, std::size_t component) const;
  [[nodiscard]] std::uint32_t index(std::size_t value) const;
  [[nodiscard]] bool isUnsigned() const;

 private:
  const unsigned char* first_ = nullptr;
  std::size_t stride_ = 0, count_ = 0;
  int type_ = 0;
  bool is_normalised_ = false;
};

}  // namespace toftwin::sim::meshes
