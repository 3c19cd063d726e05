// SPDX-License-Identifier: Apache-2.0
// What finds a picture's size before it is decoded; whatever has a size within the bound is decoded, too.
#include <cstddef>
#include <cstdint>
#include <span>

#include "sim/pictures/read.h"
#include "sim/pictures/size.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span{data, size});
  const auto found = toftwin::pictures::sizeOf(bytes);
  if (found && found->isWithinBound() && found->width * found->height < 1'000'000) (void)toftwin::pictures::decode(bytes, "fuzzed");
  return 0;
}
