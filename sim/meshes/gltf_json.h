// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace toftwin::sim::meshes {

/// What a glTF's JSON would take, found without taking it.
struct JsonSize {
  std::size_t values = 0;   ///< at most so many numbers, texts, arrays and objects
  std::size_t depth = 0;    ///< of arrays and objects within each other
  std::size_t buffers = 0;  ///< objects in the array "buffers"
  bool has_escaped_key = false;
};
JsonSize sizeOfJson(std::string_view json);

/// Why a glTF of these bytes, JSON or GLB, may not be given to a parser that trusts it: it would nest too
/// deeply, or take many times more memory than the file is long. Nothing if it may.
std::optional<std::string> whyNotToParse(std::string_view bytes);

}  // namespace toftwin::sim::meshes
