// SPDX-License-Identifier: Apache-2.0
#include "drivers/visionary/wire/crc32.h"

#include <zlib.h>

namespace toftwin::visionary {

std::uint32_t crc32Of(std::span<const std::byte> bytes) {
  return static_cast<std::uint32_t>(::crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace toftwin::visionary
