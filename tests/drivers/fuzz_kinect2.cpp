// SPDX-License-Identifier: Apache-2.0
// libFuzzer's entry: cmake --preset fuzz, then fuzz_kinect2 FOLDER
#include <cstdint>
#include <span>

#include "kinect2_fuzz_one_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  toftwin::test::fuzzKinect2(std::as_bytes(std::span{data, size}));
  return 0;
}
