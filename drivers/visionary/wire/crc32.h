// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace toftwin::visionary {

/// Of IEEE 802.3, as zlib has it.
std::uint32_t crc32Of(std::span<const std::byte> bytes);

}  // namespace toftwin::visionary
