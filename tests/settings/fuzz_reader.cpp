// SPDX-License-Identifier: Apache-2.0
// libFuzzer's entry for the reader of the name TOFTWIN_READER.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "tests/settings/readers.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto* const reader = [] {
    for (const auto& one : toftwin::readers::allReaders()) {
      if (std::string_view{one.name} == TOFTWIN_READER) return &one;
    }
    std::abort();
  }();
  static_cast<void>(reader->read({reinterpret_cast<const char*>(data), size}));
  return 0;
}
