// SPDX-License-Identifier: Apache-2.0
// libFuzzer's entry: cmake --preset fuzz, then fuzz_aravis FOLDER
#include <cstdint>
#include <span>

#include "aravis_fuzz_one_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  toftwin::drivers::aravis::fuzzOneInput(std::as_bytes(std::span{data, size}));
  return 0;
}
