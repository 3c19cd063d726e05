// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <span>
#include <string>
#include <string_view>

/// Everything that reads a text which a person wrote or another program made, for fuzzers and for tests of mutants.
namespace toftwin::readers {

struct Reader {
  const char* name;
  /// Reads the text; an Error's message, or empty where it was read. What breaks a promise aborts.
  std::string (*read)(std::string_view text);
};
/// For GoogleTest: by its name, which is the same in every run.
inline void PrintTo(const Reader& reader, std::ostream* out) { *out << reader.name; }

/// scene, camera, plan, case, model, daemon, json.
std::span<const Reader> allReaders();

}  // namespace toftwin::readers
