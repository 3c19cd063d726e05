// SPDX-License-Identifier: Apache-2.0
// libFuzzer's entry for what facades read: cmake --preset fuzz, then fuzz_o3d303_facade,
// fuzz_o3r_facade, fuzz_ros2_facade, fuzz_modbus_facade, fuzz_gige_vision_facade, fuzz_usb_camera_facade,
// fuzz_visionary_facade or fuzz_openni2_facade.
#include <cstdint>
#include <span>

#include "fuzz_one_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  toftwin::daemon::fuzzOneInput(std::as_bytes(std::span{data, size}));
  return 0;
}
