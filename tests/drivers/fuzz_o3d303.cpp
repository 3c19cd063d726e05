// SPDX-License-Identifier: Apache-2.0
// libFuzzer's entry: cmake --preset fuzz, then fuzz_o3d303 FOLDER tests/drivers/o3d303_corpus
#include <cstdint>
#include <span>

#include "o3d303_fuzz_one_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  toftwin::o3d303::fuzzOneInput(std::as_bytes(std::span{data, size}));
  return 0;
}
