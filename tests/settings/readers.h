// SPDX-License-Identifier: Apache-2.0
#pragma once

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

/// scene, camera, plan, case, model, daemon, json.
std::span<const Reader> allReaders();

}  // namespace toftwin::readers
