// SPDX-License-Identifier: Apache-2.0
#include "sim/meshes/gltf_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace toftwin::sim::meshes {
namespace {

constexpr std::size_t kMostValues = 4'000'000;      ///< a few hundred bytes each, once parsed
constexpr std::size_t kMostDepth = 64;              ///< the parser recurses
constexpr std::uint64_t kMostBufferBytes = 1 << 30; ///< each buffer of a GLB may be a copy of its binary part

/// The end of a text whose opening quote is at `at`.
std::size_t endOfText(std::string_view json, std::size_t at) {
  for (++at; at < json.size() && json[at] != '"'; ++at) {
    if (json[at] == '\\') ++at;
  }
  return at;
}

}  // namespace

JsonSize sizeOfJson(std::string_view json) {
  JsonSize size{.values = 1};
  std::size_t depth = 0;
  std::string_view text, key;  // the last text; the key of depth 1 that is being read
  for (std::size_t i = 0; i < json.size(); ++i) {
    switch (json[i]) {
      case '"': {
        const std::size_t end = endOfText(json, i);
        text = json.substr(i + 1, std::min(end, json.size()) - i - 1);
        i = end;
        break;
      }
      case ':':
        ++size.values;
        size.has_escaped_key |= text.find('\\') != text.npos;
        if (depth == 1) key = text;
        break;
      case ',':
        ++size.values;
        break;
      case '{':
      case '[':
        ++size.values;
        if (depth == 2 && json[i] == '{' && key == "buffers") ++size.buffers;
        size.depth = std::max(size.depth, ++depth);
        break;
      case '}':
      case ']':
        if (depth > 0) --depth;
        break;
      default:
        break;
    }
  }
  return size;
}

std::optional<std::string> whyNotToParse(std::string_view bytes) {
  std::string_view json = bytes;
  if (bytes.starts_with("glTF") && bytes.size() >= 20) {
    std::uint32_t length = 0;
    std::memcpy(&length, bytes.data() + 12, sizeof length);
    json = bytes.substr(20, length);
  }
  const JsonSize size = sizeOfJson(json);
  if (size.depth > kMostDepth) return fmt::format("its JSON nests {} deep, and {} is the most", size.depth, kMostDepth);
  if (size.values > kMostValues) return fmt::format("its JSON has more than {} values", kMostValues);
  if (size.has_escaped_key) return "a key of its JSON has a backslash";
  if (size.buffers > 1 && size.buffers * bytes.size() > kMostBufferBytes)
    return fmt::format("its {} buffers could take more than {} bytes", size.buffers, kMostBufferBytes);
  return std::nullopt;
}

}  // namespace toftwin::sim::meshes
