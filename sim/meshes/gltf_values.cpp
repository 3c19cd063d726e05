// SPDX-License-Identifier: Apache-2.0
#include "sim/meshes/gltf_values.h"

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "sim/meshes/faces.h"

namespace toftwin::sim::meshes {
namespace {

/// In bytes; 0: no type of glTF.
std::size_t sizeOfComponent(int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return 4;
    default:
      return 0;
  }
}

template <class T>
T numberAt(const unsigned char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

template <class T>
double integerAt(const unsigned char* at, bool is_normalised) {
  const double value = numberAt<T>(at);
  return is_normalised ? std::max(value / std::numeric_limits<T>::max(), -1.0) : value;
}

}  // namespace

Result<GltfValues> GltfValues::of(const tinygltf::Model& model, int accessor_index, int components,
                                  const std::filesystem::path& file) {
  const auto wrong = [&](std::string_view what) { return damaged(file, fmt::format("accessor {} {}", accessor_index, what)); };
  const auto number = static_cast<std::size_t>(accessor_index);
  if (number >= model.accessors.size()) return wrong("is not there");
  const tinygltf::Accessor& accessor = model.accessors[number];
  const std::size_t size = sizeOfComponent(accessor.componentType) * static_cast<std::size_t>(components);
  if (size == 0 || accessor.type != (components == 1 ? TINYGLTF_TYPE_SCALAR : components))
    return wrong("is of another type than its use");
  if (accessor.sparse.isSparse || accessor.bufferView < 0) return wrong("is sparse or empty, which is not read");
  const auto view_number = static_cast<std::size_t>(accessor.bufferView);
  if (view_number >= model.bufferViews.size()) return wrong("names a buffer view that is not there");
  const tinygltf::BufferView& view = model.bufferViews[view_number];
  const auto buffer_number = static_cast<std::size_t>(view.buffer);
  if (buffer_number >= model.buffers.size()) return wrong("names a buffer that is not there");
  const auto& data = model.buffers[buffer_number].data;
  if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset)
    return wrong("lies in a view that is longer than its buffer");
  const std::size_t stride = view.byteStride > 0 ? view.byteStride : size;
  if (stride < size || stride > 252 + size) return wrong("has a stride that cannot be");
  if (accessor.byteOffset > view.byteLength || view.byteLength - accessor.byteOffset < size || accessor.count < 1 ||
      (view.byteLength - accessor.byteOffset - size) / stride < accessor.count - 1)
    return wrong(fmt::format("of {} values is longer than its view", accessor.count));
  GltfValues values;
  values.first_ = data.data() + view.byteOffset + accessor.byteOffset;
  values.stride_ = stride;
  values.count_ = accessor.count;
  values.type_ = accessor.componentType;
  values.is_normalised_ = accessor.normalized;
  return values;
}

double GltfValues::at(std::size_t value, std::size_t component) const {
  const unsigned char* at = first_ + value * stride_ + component * sizeOfComponent(type_);
  switch (type_) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return integerAt<std::int8_t>(at, is_normalised_);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return integerAt<std::uint8_t>(at, is_normalised_);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return integerAt<std::int16_t>(at, is_normalised_);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return integerAt<std::uint16_t>(at, is_normalised_);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return integerAt<std::uint32_t>(at, is_normalised_);
    default:
      return static_cast<double>(numberAt<float>(at));
  }
}

bool GltfValues::isUnsigned() const {
  return type_ == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type_ == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
         type_ == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

std::uint32_t GltfValues::index(std::size_t value) const {
  const unsigned char* at = first_ + value * stride_;
  if (type_ == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) return *at;
  return type_ == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ? numberAt<std::uint16_t>(at) : numberAt<std::uint32_t>(at);
}

}  // namespace toftwin::sim::meshes
